"""Step 1: the match of a scan is made again from other angles, and near its prediction.

Where few points fit, the energy has several minima that are about equally deep. Without odometry, the one
that the robot's motion leads to is the likelier one.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import Prior, prior_value
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.constant_velocity import expected_errors
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.track_state import HAS_LEFT, RESTARTS, TrackingProblem, TrackState


@kernel
def restart_threshold(track: TrackState, options: ScanTrackingOptions) -> float:
    """The share of inliers below which the next scan is matched from other angles too.

    A match that is off sideways can have four fifths, but fewer than the scan before. Without odometry that
    counts only where the scan before saw clearly: outdoors most scans have few.
    """
    before = float(track.inliers[0])
    if np.isfinite(track.odometry[0]):
        return max(options.restart_inliers, before - options.inlier_margin)
    is_clear = before > options.clear_inliers
    return max(options.restart_inliers, before - options.clear_inlier_drop if is_clear else 0.0)


@kernel
def lost_threshold(track: TrackState, options: ScanTrackingOptions, odometry: Array) -> float:
    """The share of inliers below which the next scan, at `odometry` (3,), is searched.

    More are searched where nothing else tells the way, where the scan before has just left the odometry, and
    where the odometry stands though other things come into view.
    """
    if not np.isfinite(odometry[0]) or track.counts[HAS_LEFT]:
        return options.restart_inliers
    step = np.full(3, np.nan)
    relative_pose(odometry, track.odometry, step)
    stands = np.hypot(step[0], step[1]) < options.min_motion and abs(wrapped(step[2])) < options.min_motion
    return max(options.lost_inliers, track.inliers[0] - options.carried_drop if stands else 0.0)


@kernel
def match_from_other_angles(problem: TrackingProblem, points: Array, threshold: float, k: int) -> None:
    """Match scan k, which has fewer inliers than `threshold`, from angles beside the expected one too.

    A match with clearly more inliers and a lower objective takes the place of the first one.
    """
    settings, prior, found = problem.settings, problem.prior, problem.found
    # A robot may stand for hours: what is in vain for one scan there is so for the next ones.
    threshold = min(threshold, problem.track.inliers[1] - settings.options.inlier_margin)
    pose, hessian = np.empty(3), np.empty((3, 3))
    for ring in range(settings.restart_angles.shape[0]):
        if found.inliers[k] >= threshold - (settings.options.far_restart_margin if ring > 0 else 0.0):
            break
        problem.track.counts[RESTARTS] += 1
        for angle in settings.restart_angles[ring]:
            for sign in (1.0, -1.0):
                if np.isnan(angle):
                    continue
                assign(pose, prior.mean)
                pose[2] += sign * angle
                value, inliers = match_and_count(problem.grid, settings, points, prior, pose, hessian)
                # From elsewhere a scan may slide along a corridor; a wrong angle shows in the inliers.
                if inliers > found.inliers[k] + settings.options.inlier_margin and value < found.values[k]:
                    found.values[k], found.inliers[k] = value, inliers
                    assign(found.poses[k], pose)
                    assign_rows(found.hessians[k], hessian)


@kernel
def narrow_information(
    track: TrackState, options: ScanTrackingOptions, prior: Prior
) -> tuple[float, float, float]:
    """Information of x, y and turn in a prior that is as narrow as predictions have been exact."""
    place, turn = expected_errors(track)
    by_place = (options.prediction_sigmas * max(place, options.min_prediction_error)) ** -2
    by_turn = (options.prediction_sigmas * max(turn, options.min_prediction_error)) ** -2
    information = prior.information
    return (
        max(information[0, 0], by_place),
        max(information[1, 1], by_place),
        max(information[2, 2], by_turn),
    )


@kernel
def surprise(track: TrackState, options: ScanTrackingOptions, prior: Prior, pose: Array) -> float:
    """How much the objective at a pose (3,) grows if its prior is as narrow as predictions have been exact.

    It has a bound: now and then a robot does what it never did.
    """
    total, step, narrow = 0.0, pose - prior.mean, narrow_information(track, options, prior)
    step[2] = wrapped(step[2])
    for a in range(3):
        total += 0.5 * (narrow[a] - prior.information[a, a]) * step[a] * step[a]
    return float(min(total, options.max_surprise))


@kernel
def match_near_prediction(problem: TrackingProblem, points: Array, k: int) -> None:
    """Match the points (m, 2) of scan k with a prior as narrow as predictions are, if its match is far off.

    Of both the one with the lower objective counts, each with the surprise that it is.
    """
    track, options, prior, found = problem.track, problem.settings.options, problem.prior, problem.found
    off, is_near = found.poses[k] - prior.mean, True
    off[2], narrow = wrapped(off[2]), narrow_information(track, options, prior)
    for a in range(3):
        is_near &= off[a] * off[a] * narrow[a] <= 1.0
    if is_near:
        return
    wide, pose, hessian = prior.information.copy(), prior.mean.copy(), np.empty((3, 3))
    for a in range(3):
        prior.information[a, a] = narrow[a]
    value, inliers = match_and_count(problem.grid, problem.settings, points, prior, pose, hessian)
    value -= prior_value(prior, pose)
    for a in range(3):
        for b in range(3):
            hessian[a, b] += wide[a, b] - prior.information[a, b]
            prior.information[a, b] = wide[a, b]
    value += prior_value(prior, pose)
    first = found.values[k] + surprise(track, options, prior, found.poses[k])
    if value + surprise(track, options, prior, pose) <= first:
        found.values[k], found.inliers[k] = value, inliers
        assign(found.poses[k], pose)
        assign_rows(found.hessians[k], hessian)
