"""The normal distributions transform of the points of scans ([19]; paper, III-F)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.ndt.compaction import compacted
from nscan_cli.ndt.grid_growth import change_points, make_all_gaussians, with_capacity, with_scans
from nscan_cli.ndt.hash_grid import FACES, FLOOR, MINIMUM, NEIGHBOURHOOD, NO_NEIGHBOURS, Grid, empty_grid
from nscan_cli.poses import Array

INITIAL_CAPACITY = 512
"""Rows of a new NDT."""


@kernel
def _grid_of_scans(
    points: Array, ends: NDArray[np.int64], poses: Array, half: float, capacity: int, settings: Array
) -> Grid:
    """The compact grid of n scans; see `Ndt.of_scans`."""
    grid, rows = with_scans(empty_grid(capacity, settings), 0, half, points, ends, poses)
    make_all_gaussians(grid, rows, half)
    return compacted(grid, rows)


@dataclass(eq=False)
class Ndt:
    """A normal distributions transform of the points of scans."""

    cell: float
    """Side of a cell, m."""
    grid: Grid
    rows: int
    """Number of rows of the grid that are in use."""

    @classmethod
    def empty(
        cls,
        cell: float,
        minimum: int = 3,
        floor: float = 0.02,
        capacity: int = INITIAL_CAPACITY,
        neighbourhood: int = NO_NEIGHBOURS,
        faces: bool = True,
    ) -> Ndt:
        """An NDT to which points are added.

        `minimum` is the least number of points that make a Gaussian, `floor` its least standard deviation
        (m), `neighbourhood` one of NO_NEIGHBOURS, WALL_DIRECTION and WALL_END. With `faces` a wall can have
        two Gaussians, one for each face; see gaussians.py.
        """
        return cls(cell, empty_grid(capacity, _settings(minimum, floor, neighbourhood, faces)), 0)

    @classmethod
    def of_scans(
        cls,
        points: Array,
        ends: NDArray[np.int64],
        poses: Array,
        cell: float,
        minimum: int,
        floor: float,
        capacity: int = INITIAL_CAPACITY,
        neighbourhood: int = NO_NEIGHBOURS,
    ) -> Ndt:
        """The compact NDT of n scans, moved by `poses` (n, 3), to which no points can be added.

        Scan k has points[ends[k] : ends[k + 1]]. Other arguments as for `empty`.
        """
        settings = _settings(minimum, floor, neighbourhood, faces=True)
        grid = _grid_of_scans(points, ends, poses, 0.5 * cell, capacity, settings)
        return cls(cell, grid, len(grid.keys))

    @property
    def half(self) -> float:
        """Side (m) of a lattice cell."""
        return 0.5 * self.cell

    def add(self, points: Array, pose: Array) -> None:
        """Add points (m, 2), moved by `pose` (3,)."""
        self.reserve(len(points))
        self.rows = change_points(self.grid, self.rows, self.half, points, pose, 1.0, True)

    def make(self) -> None:
        """Make all Gaussians, so that none is outdated."""
        make_all_gaussians(self.grid, self.rows, self.half)

    def reserve(self, points: int) -> None:
        """Get capacity for a number of new points."""
        self.grid, self.rows = with_capacity(self.grid, self.rows, points)


def _settings(minimum: int, floor: float, neighbourhood: int, faces: bool) -> Array:
    settings = np.empty(4)
    settings[[MINIMUM, FLOOR, NEIGHBOURHOOD, FACES]] = minimum, floor, neighbourhood, faces
    return settings
