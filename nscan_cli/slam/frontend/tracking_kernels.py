"""Step 1 in compiled code: scan after scan is predicted, matched, and added to the local map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.assign import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.grid_growth import CELLS_PER_POINT
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.angle_restarts import match_from_other_angles, restart_threshold
from nscan_cli.slam.frontend.degeneracy import keep_prediction
from nscan_cli.slam.frontend.local_map import NEWEST, OLDEST, ROWS, insert_scan
from nscan_cli.slam.frontend.motion_prior import predict
from nscan_cli.slam.frontend.options import TrackingParameters
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.track_state import KNOWN, TrackState
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.visible_points import visible_points


@kernel
def points_in_view(track: TrackState, settings: TrackingParameters, points: Array, pose: Array) -> Array:
    """The points of a scan expected at `pose` (3,) that scans of the local map had in view too."""
    placed = track.map.placed[track.map.counts[OLDEST] : track.map.counts[NEWEST]]
    return visible_points(points, pose, placed, settings.visible_range)


@kernel
def settle(
    track: TrackState,
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    odometry: Array,
    prior: Prior,
    found: TrackedScans,
    k: int,
) -> None:
    """Take over the match of scan k into the state; the scan joins the map if the robot has moved.

    Its pose, inliers and Hessian of the objective were written to `found`; the rest is written here.
    """
    counts, pose, step = track.counts, found.poses[k], np.empty(3)
    pose[2] = wrapped(pose[2])
    relative_pose(pose, track.inserted, step)
    distance = np.hypot(step[0], step[1])
    # Before anything was seen there is nothing to move against.
    nothing_seen = track.map.counts[ROWS] == 0
    joins = nothing_seen or distance > settings.min_motion or abs(wrapped(step[2])) > settings.min_motion
    if joins:
        track.map.path[0] += distance
        assign(track.inserted, pose)
        insert_scan(track.map, grid, settings, points, pose)
    for row in range(track.poses.shape[0] - 1):
        assign(track.poses[row], track.poses[row + 1])
    assign(track.poses[-1], pose)
    found.odometry_sigmas[k] = 0.0
    if np.isfinite(odometry[0]) and np.isfinite(track.odometry[0]):
        off = np.hypot(pose[0] - prior.mean[0], pose[1] - prior.mean[1])
        found.odometry_sigmas[k] = off * np.sqrt(prior.information[0, 0])
    assign(track.odometry, odometry)
    counts[KNOWN] = min(counts[KNOWN] + 1, track.poses.shape[0])
    track.inliers[0] = found.inliers[k]
    found.paths[k], found.in_map[k] = track.map.path[0], joins
    found.prior_covariances[k] = 0.0
    for a in range(3):
        for b in range(3):
            found.hessians[k, a, b] -= prior.information[a, b]
        if prior.information[a, a] > 0.0:
            found.prior_covariances[k, a, a] = 1.0 / prior.information[a, a]


@kernel
def track_scans(
    track: TrackState,
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    ends: NDArray[np.int64],
    odometry: Array,
    first: int,
    prior: Prior,
    found: TrackedScans,
) -> int:
    """Track scans from the `first` on; returns the next one, which is not settled.

    Scan k has points[ends[k] : ends[k + 1]] and odometry[k], nan where there is none. The scan that is not
    settled is lost: its inliers in `found` are too few. Or the grid has no room for it: its inliers are nan.
    """
    for k in range(first, ends.shape[0] - 1):
        scan = points[ends[k] : ends[k + 1]]
        if track.map.counts[ROWS] + CELLS_PER_POINT * scan.shape[0] > grid.keys.shape[0]:
            found.inliers[k] = np.nan
            return k
        if track.counts[KNOWN] == 0:
            prior.mean[:], prior.information[:, :] = 0.0, 0.0
            found.values[k], found.poses[k], found.hessians[k], found.inliers[k] = 0.0, 0.0, 0.0, 1.0
        else:
            predict(track, settings, odometry[k], prior)
            has_odometry = np.isfinite(odometry[k, 0])
            in_view = points_in_view(track, settings, scan, prior.mean)
            assign(found.poses[k], prior.mean)
            found.values[k], found.inliers[k] = match_and_count(
                grid, settings, in_view, prior, found.poses[k], found.hessians[k]
            )
            threshold = restart_threshold(track, settings)
            if found.inliers[k] < threshold:
                match_from_other_angles(grid, settings, in_view, prior, threshold, track.counts, found, k)
                if found.inliers[k] < (settings.lost_inliers if has_odometry else settings.restart_inliers):
                    return k
            if track.counts[KNOWN] >= settings.degeneracy_poses and not has_odometry:
                keep_prediction(grid, settings, in_view, prior, track.mean_square_deviation, found, k)
        settle(track, grid, settings, scan, odometry[k], prior, found, k)
    return len(ends) - 1
