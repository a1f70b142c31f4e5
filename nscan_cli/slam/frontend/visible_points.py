"""Step 1: the points of a scan that scans of the local map had in view, too.

For a laser that sees a few metres, a wall ends at the range limit. In the map the last cell has only a piece
of the wall, and the next scan sees more of it. Its points are drawn to the middle of that piece, back to
where the robot was, by 1 mm a step. In a corridor little holds against it: with a laser of 4 m the robot lost
1.3 % of its way with odometry, and 4 to 10 % without.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.local_map import NEWEST, OLDEST
from nscan_cli.slam.frontend.options import TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.track_state import TrackState


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
