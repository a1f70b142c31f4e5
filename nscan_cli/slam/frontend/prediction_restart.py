"""Step 1 without odometry: a scan whose match is poor and far off its prediction is matched near that, too.

Where few points fit, the energy has several minima that are about equally deep. The one that the robot's
motion leads to is the likelier one.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import Prior, prior_value
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.constant_velocity import expected_errors
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.track_state import TrackingProblem, TrackState


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
