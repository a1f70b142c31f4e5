"""The normal distributions transform of points: built from one scan, grown by more ([19]; paper, III-F)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.ndt.compaction import compacted
from nscan_cli.ndt.grid_growth import change, gathered, make_all, with_room
from nscan_cli.ndt.hash_grid import ALONE, AROUND, FACES, FLOOR, MINIMUM, Grid, empty_grid
from nscan_cli.poses import Array

LEAST_CAPACITY = 512
"""Rows that an NDT has at first, unless it is known to need more."""


@kernel
def _compact_grid(
    points: Array, ends: NDArray[np.int64], poses: Array, half: float, capacity: int, making: Array
) -> Grid:
    """What is left of a grid that n scans were added to: see `of_scans`."""
    grid, rows = gathered(empty_grid(capacity, making), 0, half, points, ends, poses)
    make_all(grid, rows, half)
    return compacted(grid, rows)


@dataclass(eq=False)
class Ndt:
    """A normal distributions transform of the points of scans, in cells of a side (m)."""

    cell: float
    grid: Grid
    rows: int
    """So many rows of the grid are in use."""

    @classmethod
    def empty(
        cls,
        cell: float,
        minimum: int = 3,
        floor: float = 0.02,
        capacity: int = LEAST_CAPACITY,
        around: int = ALONE,
        faces: bool = True,
    ) -> Ndt:
        """One that grows and shrinks by scans.

        `minimum` is the least number of points that make a Gaussian, `floor` its least standard deviation
        (m). `around` says what its surroundings tell of it: ALONE, STRAIGHT or OPEN. With `faces` there are
        two where a wall has two faces; see gaussians.py.
        """
        return cls(cell, empty_grid(capacity, _making(minimum, floor, around, faces)), 0)

    @classmethod
    def of_scans(
        cls,
        points: Array,
        ends: NDArray[np.int64],
        poses: Array,
        cell: float,
        minimum: int,
        floor: float,
        capacity: int = LEAST_CAPACITY,
        around: int = ALONE,
    ) -> Ndt:
        """That of n scans, moved by `poses` (n, 3), with nothing in it but what matching needs.

        Scan k has points[ends[k] : ends[k + 1]]. Nothing can be added any more. Other arguments as for
        `empty`.
        """
        making = _making(minimum, floor, around, faces=True)
        grid = _compact_grid(points, ends, poses, 0.5 * cell, capacity, making)
        return cls(cell, grid, len(grid.keys))

    @property
    def half(self) -> float:
        """Side (m) of a lattice cell."""
        return 0.5 * self.cell

    def add(self, points: Array, pose: Array) -> None:
        """Grow by points (m, 2), moved by `pose` (3,)."""
        self._change(points, pose, 1.0)

    def subtract(self, points: Array, pose: Array) -> None:
        """Take away points that were added with the very same pose."""
        self._change(points, pose, -1.0)

    def make(self) -> None:
        """Make all Gaussians that are outdated."""
        make_all(self.grid, self.rows, self.half)

    def _change(self, points: Array, pose: Array, sign: float) -> None:
        self.reserve(len(points))
        self.rows = change(self.grid, self.rows, self.half, points, pose, sign, True)

    def reserve(self, points: int) -> None:
        """Make room for so many more points."""
        self.grid, self.rows = with_room(self.grid, self.rows, points)

    def gaussian_count(self) -> int:
        """How many Gaussians have points enough; two where a wall has two faces."""
        return int(np.count_nonzero(self.grid.gaussians[:, 2]))


def _making(minimum: int, floor: float, around: int, faces: bool) -> Array:
    making = np.empty(4)
    making[[MINIMUM, FLOOR, AROUND, FACES]] = minimum, floor, around, faces
    return making
