"""Step 1 with odometry: the scans between two that were matched, which are matched from both sides.

Points of scans close together fall into the cells of the map in the same way. In a bare corridor this ripple
is all that is left of the energy along it, and its minimum is where the last scan was. So a scan is matched
when the robot has moved by `match_motion`. The scans before it follow, with a map that holds both ends.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import composed_pose, relative_pose, wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.laser_view import points_in_view
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.scan_to_map import match_from_prediction
from nscan_cli.slam.frontend.track_state import NEXT, TrackingProblem, TrackState


@kernel
def waits_for_motion(
    track: TrackState, options: ScanTrackingOptions, odometry: Array, k: int, pose: Array, may_wait: bool
) -> bool:
    """Whether scan k is still close to the last matched scan, by odometry (n, 3) and its match, `pose` (3,).

    A scan never waits without odometry, or for one without. The last one waits only if it `may_wait`.
    """
    has_next = k + 1 < odometry.shape[0]
    if not (np.isfinite(odometry[k + 1, 0]) if has_next else may_wait):
        return False
    if k - track.counts[NEXT] + 1 >= options.max_waiting:
        return False
    step = np.full(3, np.nan)
    relative_pose(odometry[k], track.odometry, step)
    if not _is_short(step, options):
        return False
    relative_pose(pose, track.poses[-1], step)
    return _is_short(step, options)


@kernel
def _is_short(step: Array, options: ScanTrackingOptions) -> bool:
    distance, turn = np.hypot(step[0], step[1]), abs(wrapped(step[2]))
    return bool(distance < options.match_motion and turn < options.match_motion)


@kernel
def match_between(problem: TrackingProblem, before: tuple[Array, Array], first: int, last: int) -> None:
    """Match the scans from the `first` on, before the `last`, which is settled. Overwrites the prior.

    `before` has the pose (3,) of the matched scan before them and its odometry (3,). The error of odometry at
    the last scan is distributed over the way; so is the covariance of the step.
    """
    pose_before, odometry_before = before
    settings, ends, odometry, found = problem.settings, problem.ends, problem.odometry, problem.found
    step, length = np.empty(3), 0.0
    lengths = np.empty(last - first + 1)
    for k in range(first, last + 1):
        relative_pose(odometry[k], odometry[k - 1] if k > first else odometry_before, step)
        length += np.hypot(step[0], step[1]) + abs(wrapped(step[2])) + settings.options.least_between_step
        lengths[k - first] = length
    relative_pose(odometry[last], odometry_before, step)
    path = found.paths[last] - (np.hypot(step[0], step[1]) if found.in_map[last] else 0.0)
    prior, missing = problem.prior, np.empty(3)
    composed_pose(pose_before, step, prior.mean)
    prior.information[:, :] = 0.0
    for a in range(3):
        missing[a] = found.poses[last, a] - prior.mean[a]
        prior.information[a, a] = settings.options.between_sigma**-2
    missing[2] = wrapped(missing[2])
    shares = 0.0
    for k in range(first, last):
        share = lengths[k - first] / length
        relative_pose(odometry[k], odometry_before, step)
        composed_pose(pose_before, step, prior.mean)
        for a in range(3):
            prior.mean[a] += share * missing[a]
        prior.mean[2] = wrapped(prior.mean[2])
        points = problem.points[ends[k] : ends[k + 1]]
        match_from_prediction(problem, points_in_view(problem.track, settings, points, prior.mean), k)
        # The map holds the last scan: what differs from the scans before it is an inlier there.
        found.inliers[k] = min(found.inliers[k], found.inliers[last])
        found.poses[k, 2] = wrapped(found.poses[k, 2])
        found.odometry_sigmas[k], found.in_map[k] = share * found.odometry_sigmas[last], False
        found.paths[k] = path + share * (found.paths[last] - path)
        found.prior_covariances[k] = 0.0
        for a in range(3):
            found.hessians[k, a, a] -= prior.information[a, a]
            found.prior_covariances[k, a, a] = (share - shares) * found.prior_covariances[last, a, a]
        shares = share
    for a in range(3):
        found.prior_covariances[last, a, a] *= 1.0 - shares
