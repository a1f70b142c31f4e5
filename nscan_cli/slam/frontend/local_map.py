"""The local map of tracking: the scans of the last metres, whose points are the NDT that is matched with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.ndt.grid_growth import change_points
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array, transform
from nscan_cli.slam.frontend.options import TrackingParameters

NEWEST, OLDEST, ROWS = 0, 1, 2
"""Places in `LocalMap.counts`: the end of the scans that joined the map, the first of them that it still
holds, and the rows of the grid."""


class LocalMap(NamedTuple):
    """The scans that joined the map; scan s has points[ends[s] : ends[s + 1]]."""

    points: Array
    """(P, 2) points of one scan after another, each in its robot's frame."""
    ends: NDArray[np.int64]
    """(W + 1,)"""
    placed: Array
    """(W, 4) the scans' poses, and the length of the path up to each (m)."""
    counts: NDArray[np.int64]
    """(3,) NEWEST, OLDEST and ROWS"""
    path: Array
    """(1,) length of the path, m."""

    @classmethod
    def empty(cls) -> LocalMap:
        """The map before the first scan."""
        ends, counts = np.zeros(1, dtype=np.int64), np.zeros(3, dtype=np.int64)
        return cls(np.zeros((0, 2)), ends, np.zeros((0, 4)), counts, np.zeros(1))

    def with_room(self, scans: int, points: int) -> LocalMap:
        """The map with room for this number of further scans and points."""
        oldest, newest = self.counts[[OLDEST, NEWEST]].tolist()
        first, last = self.ends[[oldest, newest]].tolist()
        if newest + scans <= len(self.placed) and last + points <= len(self.points):
            return self
        held, held_points = newest - oldest, last - first
        roomy_points, placed = np.empty((2 * (held_points + points), 2)), np.empty((2 * (held + scans), 4))
        ends = np.empty(len(placed) + 1, dtype=np.int64)
        roomy_points[:held_points], placed[:held] = self.points[first:last], self.placed[oldest:newest]
        ends[: held + 1] = self.ends[oldest : newest + 1] - first
        self.counts[[OLDEST, NEWEST]] = 0, held
        return self._replace(points=roomy_points, ends=ends, placed=placed)

    def recent_points(self, path: float) -> Array:
        """The points (m, 2) of the scans over the last `path` (m), in the tracker's frame."""
        oldest, newest = self.counts[[OLDEST, NEWEST]].tolist()
        return np.concatenate(
            [
                transform(self.placed[scan, :3], self.points[self.ends[scan] : self.ends[scan + 1]])
                for scan in range(oldest, newest)
                if self.placed[scan, 3] > self.path[0] - path
            ]
        )


@kernel
def insert_scan(
    local_map: LocalMap, grid: Grid, settings: TrackingParameters, points: Array, pose: Array
) -> None:
    """Let a scan (m, 2) at `pose` (3,) join the map; scans that are farther back than the window leave it."""
    counts, newest = local_map.counts, local_map.counts[NEWEST]
    first = local_map.ends[newest]
    assign_rows(local_map.points[first : first + points.shape[0]], points)
    local_map.ends[newest + 1] = first + points.shape[0]
    assign(local_map.placed[newest, :3], pose)
    local_map.placed[newest, 3] = local_map.path[0]
    counts[NEWEST] += 1
    _change_grid(local_map, grid, settings, newest, 1.0)
    while local_map.placed[counts[OLDEST], 3] < local_map.path[0] - settings.options.window:
        _change_grid(local_map, grid, settings, counts[OLDEST], -1.0)
        counts[OLDEST] += 1


@kernel
def remove_newest(local_map: LocalMap, grid: Grid, settings: TrackingParameters) -> None:
    """Take the scan that joined the map last out of it."""
    local_map.counts[NEWEST] -= 1
    _change_grid(local_map, grid, settings, local_map.counts[NEWEST], -1.0)


@kernel
def _change_grid(
    local_map: LocalMap, grid: Grid, settings: TrackingParameters, scan: int, sign: float
) -> None:
    points = local_map.points[local_map.ends[scan] : local_map.ends[scan + 1]]
    pose, counts = local_map.placed[scan, :3], local_map.counts
    # Half of the Gaussians change again before any point meets them.
    counts[ROWS] = change_points(grid, counts[ROWS], settings.half, points, pose, sign, False)
