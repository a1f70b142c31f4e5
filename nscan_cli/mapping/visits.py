"""How many visits of a robot have hit each cell of a map, and how many have looked through it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.occupancy import OccupancyGrid, occupancy_grid
from nscan_cli.poses import Array, Indices, path_lengths


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

    path = path_lengths(poses)
    numbers = (path / length).astype(np.int64)
    found = VisitCounts(np.zeros(grid.shape, dtype=np.int32), np.zeros(grid.shape, dtype=np.int32))
    around = np.ones((3, 3), dtype=np.bool_)
    for number in np.unique(numbers).tolist():
        of_visit = numbers == number
        part = occupancy_grid(log, rows[of_visit], poses[of_visit], grid.resolution, options=grid.options)
        hit, misses = part.hits > 0, part.misses
        looked = (misses >= min_looks) & ~ndimage.binary_dilation(hit, around)
        whole, own = _common_cells(grid, part)
        found.hit[whole] += hit[own]
        found.through[whole] += looked[own]
    return found


_Cells = tuple[slice, slice]
"""Rows and columns."""


def _common_cells(grid: OccupancyGrid, part: OccupancyGrid) -> tuple[_Cells, _Cells]:
    """The cells of a grid that a part of its map has as well, and the same as cells of the part.

    The part may reach beyond: at its first and last scan, the path that a turning laser is moved along ends.
    """
    whole, own = [], []
    for axis in (0, 1):
        offset = round((part.origin[1 - axis] - grid.origin[1 - axis]) / grid.resolution)
        first, last = max(0, offset), min(grid.shape[axis], offset + part.shape[axis])
        whole.append(slice(first, last))
        own.append(slice(first - offset, last - offset))
    return (whole[0], whole[1]), (own[0], own[1])
