"""A map without what robots cannot use: space seen through glass, single specks, and people who went.

What is removed leaves the counts of hits and misses, so that all that is made of the map agrees. Who went is
known by how many visits of the robot have hit each cell, and how many have looked through it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, OccupancyGrid, grid_of_counts, occupancy_grid
from nscan_cli.poses import Array, Indices, Mask, path_lengths


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


@dataclass(frozen=True)
class CleaningOptions:
    """Decide what is removed."""

    visit_length: float = 20.0
    """Length of the path of one visit, m. A larger value keeps more people: who stands at a place throughout
    is in one visit, and no other looks through."""
    min_looks: int = 2
    """Least number of beams of a visit through a cell for the visit to have looked through it. A larger value
    removes less, as it ignores stray beams."""
    looks_per_hit: float = 2.0
    """Least ratio of visits that look through a cell to those that hit it if what stood there has gone. A
    larger value removes less. A smaller one also removes doors that were open half of the time."""
    visits_of_post: int = 2
    """Least number of visits that have hit a single occupied cell that stays, as a post or the leg of a
    table. A larger value removes more, such as railings."""


class Removed(NamedTuple):
    """What was removed: cells (H, W) that are different from before."""

    gone: Mask
    """Hit by few visits, and looked through by others: people, and what was carried away."""
    specks: Mask
    """Occupied cells without an occupied cell beside them, seen by one visit only."""
    unconnected: Mask
    """Free, and not connected to where the robot was; and occupied, without free space beside."""

    def counts(self) -> dict[str, int]:
        """Name → cells."""
        return {name: int(mask.sum()) for name, mask in zip(self._fields, self, strict=True)}


def cleaned_map(
    grid: OccupancyGrid, log: LaserLog, rows: Indices, poses: Array, options: CleaningOptions | None = None
) -> tuple[OccupancyGrid, Removed]:
    """The grid of the scans in `rows` (N,) at `poses` without what is to be removed, and what that was."""
    from scipy import ndimage

    options = options or CleaningOptions()
    hits, misses, states = grid.hits, grid.misses, grid.states()
    visits = visit_counts(grid, log, rows, poses, options.visit_length, options.min_looks)
    occupied = states == OCCUPIED
    gone = occupied & (visits.through > 0) & (visits.through >= options.looks_per_hit * visits.hit)
    occupied &= ~gone
    around = np.ones((3, 3), dtype=np.int8)
    alone = ndimage.convolve(occupied.astype(np.int8), around, mode="constant") == 1
    specks = occupied & alone & (visits.hit < options.visits_of_post)
    occupied &= ~specks
    hits[gone | specks] = 0
    free = ((states == FREE) | gone | specks) & (misses > 0)
    reached = _connected(free, grid.cells_of(poses[:, :2]))
    walls, count = ndimage.label(occupied, around)
    seen = np.zeros(count + 1, dtype=np.bool_)
    seen[np.unique(walls[ndimage.binary_dilation(reached, around)])] = True
    unconnected = (free & ~reached) | (occupied & ~seen[walls])
    hits[unconnected] = misses[unconnected] = 0
    cleaned = grid_of_counts(hits, misses, grid.resolution, grid.origin, grid.options)
    return cleaned, Removed(gone & ~unconnected, specks & ~unconnected, unconnected)


def _connected(free: Mask, start: tuple[Indices, Indices]) -> Mask:
    """The free cells from which others lead to a cell of the start, across sides of cells."""
    from scipy import ndimage

    space = free.copy()
    space[start] = True
    labels, count = ndimage.label(space)
    reached = np.zeros(count + 1, dtype=np.bool_)
    reached[np.unique(labels[start])] = True
    return reached[labels] & free
