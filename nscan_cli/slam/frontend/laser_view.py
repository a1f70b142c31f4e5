"""Step 1: the points of a scan that scans of the local map had in view, too.

For a laser that sees a few metres, a wall ends at the range limit. In the map the last cell has only a piece
of the wall, and the next scan sees more of it. Its points are drawn to the middle of that piece, back to
where the robot was, by 1 mm a step. In a corridor little holds against it: with a laser of 4 m the robot lost
1.3 % of its way with odometry, and 4 to 10 % without.

A laser that looks ahead sees new walls at its sides when the robot drives backwards or turns. In the map
these walls end at the border of the sector in which its scans looked. These ends attract the new points, too:
in a bare corridor a robot that drove backwards seemed to stand.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.poses import Array, compose
from nscan_cli.slam.frontend.local_map import NEWEST, OLDEST
from nscan_cli.slam.frontend.options import LaserView, TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.scan_to_map import match_and_count, match_from_prediction
from nscan_cli.slam.frontend.track_state import TrackingProblem, TrackState


def range_limit(ranges: NDArray[np.float32], options: TrackingOptions) -> float:
    """The range (m) at which walls end for a laser with such ranges (m); infinity if they do not."""
    if not len(ranges):
        return np.inf
    limit, cell = float(np.quantile(ranges, 1 - options.range_limit_outliers)), options.gaussians.cell
    return limit if np.mean(ranges > limit - cell) >= options.range_limit_share else np.inf


@kernel
def visible_points(points: Array, pose: Array, placed: Array, far: float) -> Array:
    """The points (m, 2) within `far` (m) of where a scan of the map was taken, or of their own `pose` (3,).

    The first columns of `placed` (W, 4) are the positions of the map's scans, the newest last.
    """
    seen, n = np.empty((points.shape[0], 2)), 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(points.shape[0]):
        is_seen = points[k, 0] ** 2 + points[k, 1] ** 2 <= far * far
        if not is_seen:
            x = pose[0] + cos * points[k, 0] - sin * points[k, 1]
            y = pose[1] + sin * points[k, 0] + cos * points[k, 1]
            for scan in range(placed.shape[0] - 1, -1, -1):
                is_seen = (placed[scan, 0] - x) ** 2 + (placed[scan, 1] - y) ** 2 <= far * far
                if is_seen:
                    break
        if is_seen:
            seen[n, 0], seen[n, 1] = points[k, 0], points[k, 1]
            n += 1
    return seen[:n]


@kernel
def points_in_view(track: TrackState, settings: TrackingParameters, points: Array, pose: Array) -> Array:
    """The points of a scan expected at `pose` (3,) that scans of the local map had in view too."""
    placed = track.map.placed[track.map.counts[OLDEST] : track.map.counts[NEWEST]]
    return visible_points(points, pose, placed, settings.visible_range)


def laser_view(log: LaserLog, options: TrackingOptions) -> LaserView:
    """What the laser of a log has in view."""
    limit = range_limit(log.ranges[log.ranges < options.max_range], options)
    first, last, step = field_of_view(log)
    half = 0.5 * abs(last - first)
    if half > np.pi - 0.5 * options.whole_turn_beams * abs(step):
        return LaserView.all_around(limit)
    return LaserView(limit, compose(log.mount, np.array([0.0, 0.0, 0.5 * (first + last)])), half)


@kernel
def points_in_sector(track: TrackState, settings: TrackingParameters, points: Array, pose: Array) -> Array:
    """The points (m, 2) of a scan at `pose` (3,) that lie in the sector of a scan of the local map.

    Points at its border do not count: the map's piece of their wall is cut there.
    """
    half, middle, margin = settings.laser.half_angle, settings.laser.middle, settings.options.sector_margin
    if half >= np.pi:
        return points
    placed = track.map.placed[track.map.counts[OLDEST] : track.map.counts[NEWEST]]
    # Where the laser was, and the normals of both borders, to the inside; the newest scan first.
    sectors, known = np.empty((placed.shape[0], 6)), 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    seen, n = np.empty((points.shape[0], 2)), 0
    for k in range(points.shape[0]):
        x = pose[0] + cos * points[k, 0] - sin * points[k, 1]
        y = pose[1] + sin * points[k, 0] + cos * points[k, 1]
        for scan in range(placed.shape[0]):
            sector = sectors[scan]
            if scan == known:
                _write_sector(placed[placed.shape[0] - 1 - scan], middle, half, sector)
                known += 1
            dx, dy = x - sector[0], y - sector[1]
            is_left = dx * sector[2] + dy * sector[3] >= margin
            is_right = dx * sector[4] + dy * sector[5] >= margin
            if (is_left or is_right) if half > 0.5 * np.pi else (is_left and is_right):
                seen[n, 0], seen[n, 1] = points[k, 0], points[k, 1]
                n += 1
                break
    return seen[:n]


@kernel
def _write_sector(placed: Array, middle: Array, half: float, sector: Array) -> None:
    cos, sin = np.cos(placed[2]), np.sin(placed[2])
    right, left = placed[2] + middle[2] - half, placed[2] + middle[2] + half
    sector[0] = placed[0] + cos * middle[0] - sin * middle[1]
    sector[1] = placed[1] + sin * middle[0] + cos * middle[1]
    sector[2], sector[3] = -np.sin(right), np.cos(right)
    sector[4], sector[5] = np.sin(left), -np.cos(left)


@kernel
def match_in_sector(problem: TrackingProblem, points: Array, threshold: float, k: int) -> Array:
    """Match scan k from its prediction with those of its points (m, 2) that lie in the sector there.

    If that has fewer inliers than `threshold`, or turns the scan far from the prediction, the prediction was
    wrong, and with it the choice: all points are matched. Returns the points that were.
    """
    settings, prior, found = problem.settings, problem.prior, problem.found
    in_sector = points_in_sector(problem.track, settings, points, prior.mean)
    match_from_prediction(problem, in_sector, k)
    turned = abs(wrapped(found.poses[k, 2] - prior.mean[2]))
    if in_sector.shape[0] == points.shape[0] or (
        found.inliers[k] >= threshold and turned <= settings.options.sector_turn
    ):
        return in_sector
    match_from_prediction(problem, points, k)
    return points


@kernel
def match_again_in_sector(problem: TrackingProblem, points: Array, k: int) -> Array:
    """Match scan k from where all of its points (m, 2) were matched, with those in the sector there.

    The share of inliers stays that of all. Returns the points that were matched.
    """
    grid, settings, found = problem.grid, problem.settings, problem.found
    in_sector = points_in_sector(problem.track, settings, points, found.poses[k])
    if in_sector.shape[0] == points.shape[0] or in_sector.shape[0] == 0:
        return points
    pose, hessian = found.poses[k], found.hessians[k]
    found.values[k], _ = match_and_count(grid, settings, in_sector, problem.prior, pose, hessian)
    return in_sector
