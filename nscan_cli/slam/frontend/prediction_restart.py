"""Step 1 without odometry: a scan whose match is poor and far off its prediction is matched near that, too.

Where few points fit, the energy has several minima that are about equally deep. The one that the robot's
motion leads to is the likelier one.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import prior_value
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.constant_velocity import expected_errors
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracking_problem import TrackingProblem


@kernel
def match_near_prediction(problem: TrackingProblem, points: Array, k: int) -> None:
    """Match the points (m, 2) of scan k with a prior as narrow as predictions are, if its match is far off.

    The other match takes its place unless it has clearly fewer inliers.
    """
    options, prior, found = problem.settings.options, problem.prior, problem.found
    place, turn = expected_errors(problem.track)
    place, turn = max(place, options.min_prediction_error), max(turn, options.min_prediction_error)
    off = np.hypot(found.poses[k, 0] - prior.mean[0], found.poses[k, 1] - prior.mean[1])
    turned = abs(wrapped(found.poses[k, 2] - prior.mean[2]))
    if off <= options.far_prediction * place and turned <= options.far_prediction * turn:
        return
    wide, pose, hessian = prior.information.copy(), prior.mean.copy(), np.empty((3, 3))
    for a in range(3):
        narrow = options.prediction_sigmas * (turn if a == 2 else place)
        prior.information[a, a] = max(prior.information[a, a], narrow**-2)
    value, inliers = match_and_count(problem.grid, problem.settings, points, prior, pose, hessian)
    value -= prior_value(prior, pose)
    is_good = inliers >= found.inliers[k] - options.inlier_margin
    for a in range(3):
        for b in range(3):
            if is_good:
                found.hessians[k, a, b] = hessian[a, b] - prior.information[a, b] + wide[a, b]
            prior.information[a, b] = wide[a, b]
    if is_good:
        found.values[k], found.inliers[k] = value + prior_value(prior, pose), inliers
        assign(found.poses[k], pose)
