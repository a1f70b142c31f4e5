"""Step 1 in compiled code: scan after scan is predicted, matched, and added to the local map."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import Prior, motion_sigmas, prior_value
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.ndt.grid_growth import CELLS_PER_POINT
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.between_scans import match_between, waits_for_motion
from nscan_cli.slam.frontend.constant_velocity import learn_prediction
from nscan_cli.slam.frontend.degeneracy import keep_prediction
from nscan_cli.slam.frontend.deskewing import deskew_by_last_step, deskew_by_match
from nscan_cli.slam.frontend.laser_view import match_again_in_sector, match_in_sector, points_in_view
from nscan_cli.slam.frontend.local_map import ROWS, insert_scan
from nscan_cli.slam.frontend.match_restarts import (
    lost_threshold,
    match_from_other_angles,
    match_near_prediction,
    restart_threshold,
)
from nscan_cli.slam.frontend.odometry_noise import learn_noise
from nscan_cli.slam.frontend.prediction import (
    contradicts,
    predict_prior,
    predict_prior_by_trusted_odometry,
    predict_prior_steadily,
)
from nscan_cli.slam.frontend.scan_to_map import match_from_prediction
from nscan_cli.slam.frontend.track_state import (
    CONTRADICTIONS,
    HAS_LEFT,
    KNOWN,
    MAY_WAIT,
    NEXT,
    TrackingProblem,
)


@kernel
def _settle(problem: TrackingProblem, k: int) -> None:
    """Take over the match of scan k into the state, then match the scans that wait for it.

    The scan joins the map if the robot has moved. Its pose, inliers and Hessian of the objective were written
    to `found`; the rest is written here.
    """
    track, settings, odometry = problem.track, problem.settings, problem.odometry
    options = settings.options
    prior, found, ends = problem.prior, problem.found, problem.ends
    counts, pose, step = track.counts, found.poses[k], np.empty(3)
    before = track.poses[-1].copy(), track.odometry.copy()
    pose[2] = wrapped(pose[2])
    relative_pose(pose, track.inserted, step)
    distance = np.hypot(step[0], step[1])
    # Before anything was seen there is nothing to move against.
    nothing_seen = counts[KNOWN] == 0 or track.map.counts[ROWS] == 0
    has_moved = distance > options.min_motion or abs(wrapped(step[2])) > options.min_motion
    joins = nothing_seen or (has_moved and found.weakest_sigmas[k] < np.inf)
    if joins:
        track.map.path[0] += distance
        assign(track.inserted, pose)
        insert_scan(track.map, problem.grid, settings, problem.points[ends[k] : ends[k + 1]], pose)
    found.odometry_sigmas[k], length, along = 0.0, np.nan, np.inf
    if np.isfinite(odometry[k, 0]) and np.isfinite(track.odometry[0]):
        relative_pose(odometry[k], track.odometry, step)
        length, along = np.hypot(step[0], step[1]), motion_sigmas(step, options.trusted_odometry)[0]
        off = np.hypot(pose[0] - prior.mean[0], pose[1] - prior.mean[1])
        found.odometry_sigmas[k] = off / max(along, prior.information[0, 0] ** -0.5)
    assign(track.odometry, odometry[k])
    track.inliers[0], track.inliers[1] = found.inliers[k], np.inf
    found.paths[k], found.in_map[k] = track.map.path[0], joins
    found.prior_covariances[k] = 0.0
    for a in range(3):
        for b in range(3):
            found.hessians[k, a, b] -= prior.information[a, b]
        if prior.information[a, a] > 0.0:
            found.prior_covariances[k, a, a] = 1.0 / prior.information[a, a]
    learn_noise(
        track.odometry_noise, options.odometry_noise, pose, odometry[k], length, found.hessians[k], along**-2
    )
    tells = found.inliers[k] >= options.restart_inliers
    tells &= found.weakest_sigmas[k] <= options.degeneracy.trusted_sigma
    if tells and settings.is_alone:
        learn_prediction(track, options, problem.times[k], pose)
    first = counts[NEXT]
    if first < k:
        match_between(problem, before, first, k)
    for scan in range(first, k + 1):
        for row in range(track.poses.shape[0] - 1):
            assign(track.poses[row], track.poses[row + 1])
            track.times[row] = track.times[row + 1]
        assign(track.poses[-1], found.poses[scan])
        track.times[-1] = problem.times[scan]
    counts[KNOWN], counts[NEXT] = min(counts[KNOWN] + k + 1 - first, track.poses.shape[0]), k + 1


@kernel
def match_with_doubt(problem: TrackingProblem, points: Array, threshold: float, k: int) -> None:
    """Match the points (m, 2) of scan k again with a wide prior if it contradicts odometry or fits badly.

    With fewer inliers than `threshold` it is also matched from other angles. Another match replaces the first
    one if it has clearly more inliers, and pays for being off the odometry unless only the first one is lost.
    If the first one contradicts odometry, a lower energy is enough.
    """
    options, prior, found = problem.settings.options, problem.prior, problem.found
    is_contradiction = contradicts(prior, found.poses[k], options.contradiction_sigmas)
    if not is_contradiction and found.inliers[k] >= threshold:
        problem.track.counts[CONTRADICTIONS] = 0
        return
    trusted, inliers, value = prior.information.copy(), found.inliers[k], found.values[k]
    energy = value - prior_value(prior, found.poses[k])
    pose, hessian = found.poses[k].copy(), found.hessians[k].copy()
    predict_prior(problem.track, options, problem.times[k], problem.odometry[k], options.odometry, prior)
    match_from_prediction(problem, points, k)
    if found.inliers[k] < threshold:
        match_from_other_angles(problem, points, threshold, k)
    has_more = found.inliers[k] > inliers + options.inlier_margin
    is_found = inliers < options.lost_inliers <= found.inliers[k]
    has_more &= is_found or _pays_for_odometry(problem, trusted, value, k)
    fits_better = found.values[k] - prior_value(prior, found.poses[k]) < energy
    if not (has_more or (is_contradiction and fits_better)):
        found.values[k], found.inliers[k] = value, inliers
        assign(found.poses[k], pose)
        assign_rows(found.hessians[k], hessian)
        assign_rows(prior.information, trusted)
    has_left = contradicts(Prior(prior.mean, trusted), found.poses[k], options.contradiction_sigmas)
    problem.track.counts[CONTRADICTIONS] = problem.track.counts[CONTRADICTIONS] + 1 if has_left else 0


@kernel
def _pays_for_odometry(problem: TrackingProblem, trusted: Array, value: float, k: int) -> bool:
    """Whether the match of scan k gains more than it costs to be off the odometry, whose information is
    `trusted` (3, 3), against another match of this `value`.

    It costs nothing where several scans before left the odometry, too, where the odometry stands, as it does
    if the robot is carried, or where it is no odometry but the motion from behind.
    """
    options, prior = problem.settings.options, problem.prior
    pose, step = problem.found.poses[k], np.empty(3)
    relative_pose(problem.odometry[k], problem.track.odometry, step)
    has_slipped = problem.track.counts[CONTRADICTIONS] > options.believed_contradictions
    if problem.settings.is_alone or has_slipped or np.hypot(step[0], step[1]) < options.min_motion:
        return True
    price = min(prior_value(Prior(prior.mean, trusted), pose), options.max_odometry_surprise)
    return bool(problem.found.values[k] - prior_value(prior, pose) + price < value)


@kernel
def track_scans(problem: TrackingProblem, first: int, may_wait: bool, is_matched: bool) -> int:
    """Track scans from the `first` on; returns the next one, which is not settled. If the first one
    `is_matched` already, it alone is settled.

    A scan waits until the robot has moved; the last ones settle unless they `may_wait` for scans that are not
    here yet. A scan that is not settled is lost: its inliers in `found` are too few. Or the grid has no room:
    its inliers are nan.
    """
    track, grid, settings = problem.track, problem.grid, problem.settings
    options = settings.options
    ends, odometry, prior, found = problem.ends, problem.odometry, problem.prior, problem.found
    step, is_swept = np.empty(3), problem.shares.shape[0] > 0
    for k in range(first, ends.shape[0] - 1):
        scan = problem.points[ends[k] : ends[k + 1]]
        if track.map.counts[ROWS] + CELLS_PER_POINT * scan.shape[0] > grid.keys.shape[0]:
            found.inliers[k] = np.nan
            return k
        if is_matched:
            pass
        elif track.counts[KNOWN] == 0:
            prior.mean[:], prior.information[:, :] = 0.0, 0.0
            found.values[k], found.poses[k], found.hessians[k], found.inliers[k] = 0.0, 0.0, 0.0, 1.0
        else:
            predict_prior_by_trusted_odometry(track, options, problem.times[k], odometry[k], prior)
            has_odometry = np.isfinite(odometry[k, 0])
            shares = problem.shares[ends[k] : ends[k + 1]]
            if is_swept:
                deskew_by_last_step(track, scan, shares, step)
            in_view = points_in_view(track, settings, scan, prior.mean)
            threshold = restart_threshold(track, options)
            matched = match_in_sector(problem, in_view, threshold, k)
            if is_swept and deskew_by_match(track, options, scan, shares, step, found.poses[k]):
                in_view = points_in_view(track, settings, scan, prior.mean)
                matched = match_in_sector(problem, in_view, threshold, k)
            if has_odometry and np.isfinite(track.odometry[0]):
                match_with_doubt(problem, matched, threshold, k)
            elif found.inliers[k] < threshold:
                match_from_other_angles(problem, matched, threshold, k)
                if settings.is_alone:
                    match_near_prediction(problem, matched, k)
            least = lost_threshold(track, options, odometry[k])
            # Odometry stands where the robot is carried. What is in vain for one scan is so for the next.
            is_lost = found.inliers[k] < least <= min(track.inliers[0], track.inliers[1])
            waits = waits_for_motion(track, options, odometry, k, found.poses[k], may_wait)
            if waits and found.inliers[k] < threshold and track.inliers[1] == np.inf:
                track.inliers[1] = found.inliers[k]
            track.counts[MAY_WAIT] = waits
            if is_lost or (found.inliers[k] < least and not waits):
                return k
            if waits:
                continue
            if matched.shape[0] == in_view.shape[0]:
                matched = match_again_in_sector(problem, in_view, k)
            if track.counts[KNOWN] >= options.degeneracy_poses and not has_odometry:
                found.values[k] -= prior_value(prior, found.poses[k])
                predict_prior_steadily(track, options, problem.times[k], prior)
                found.values[k] += prior_value(prior, found.poses[k])
                keep_prediction(grid, settings, matched, prior, track.mean_square_deviation, found, k)
            track.counts[HAS_LEFT] = 0
        _settle(problem, k)
        if is_matched:
            return k + 1
    return int(ends.shape[0]) - 1
