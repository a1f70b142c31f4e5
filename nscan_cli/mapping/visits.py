"""How many visits of a robot have hit each cell of a map, and how many have looked through it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.occupancy import OccupancyGrid, occupancy_grid
from nscan_cli.poses import Array, Indices


class VisitCounts(NamedTuple):
    """Visits for each cell (H, W) of a grid."""

    hit: NDArray[np.int32]
    """Those with a beam that ends in the cell."""
    through: NDArray[np.int32]
    """Those with beams through the cell, and none that ends in it or beside it: a wall whose cells other
    visits hit beside it has not gone."""


def visit_counts(
    grid: OccupancyGrid, log: LaserLog, rows: Indices, poses: Array, length: float, min_looks: int
) -> VisitCounts:
    """The counts of a grid that was made of the scans in `rows` (N,) at `poses` (N, 3).

    A visit is a piece of the path of `length` (m). At least `min_looks` beams look through a cell.
    """
    from scipy import ndimage

    path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    numbers = (path / length).astype(np.int64)
    found = VisitCounts(np.zeros(grid.shape, dtype=np.int32), np.zeros(grid.shape, dtype=np.int32))
    around = np.ones((3, 3), dtype=np.bool_)
    for number in np.unique(numbers).tolist():
        of_visit = numbers == number
        part = occupancy_grid(log, rows[of_visit], poses[of_visit], grid.resolution, options=grid.options)
        hit, misses = part.hits > 0, part.misses
        left, bottom = (
            round((there - here) / grid.resolution)
            for there, here in zip(part.origin, grid.origin, strict=True)
        )
        place = slice(bottom, bottom + part.shape[0]), slice(left, left + part.shape[1])
        found.hit[place] += hit
        found.through[place] += (misses >= min_looks) & ~ndimage.binary_dilation(hit, around)
    return found
