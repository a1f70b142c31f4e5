"""When and how the match of a scan is started again from other angles."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.track_state import RESTARTS, TrackingProblem, TrackState


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
