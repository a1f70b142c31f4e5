"""The normal distributions transform of the points of scans ([19]; paper, III-F)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.kernels.array_assignment import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.ndt.grid_growth import add_points, change_points, make_all_gaussians, with_capacity
from nscan_cli.ndt.hash_grid import (
    COSINE,
    ELONGATION,
    END_RATIO,
    END_SHARE,
    FACES,
    FLOOR,
    LEAST_RATIO,
    MAX_NEIGHBOUR,
    MAX_SPACING,
    MIN_SPACING,
    MINIMUM,
    NEIGHBOURHOOD,
    NO_NEIGHBOURS,
    SIDE_SHARE,
    Grid,
    empty_grid,
    rehash,
    table_size,
)
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.poses import Array, Indices

INITIAL_CAPACITY = 512
"""Rows of a new NDT."""


@kernel
def _grid_of_scans(
    points: Array, ends: Indices, poses: Array, half: float, capacity: int, settings: Array
) -> Grid:
    """The compact grid of n scans; see `Ndt.of_scans`."""
    grid, rows, touched = empty_grid(capacity, settings), 0, np.empty(points.shape[0], dtype=np.int32)
    for k in range(poses.shape[0]):
        scan = points[ends[k] : ends[k + 1]]
        grid, rows = with_capacity(grid, rows, scan.shape[0])
        rows = add_points(grid, rows, half, scan, poses[k], 1.0, touched)
    make_all_gaussians(grid, rows, half)
    return _compacted(grid, rows)


@kernel
def _compacted(grid: Grid, rows: int) -> Grid:
    """The Gaussians of the first `rows` that have enough points, and the lattice cells in their blocks.

    Those of the other face of a wall follow all others. No points can be added to the copy.
    """
    capacity = grid.keys.shape[0]
    places, fronts, backs = np.full(rows, -1, dtype=np.int32), 0, 0
    for row in range(rows):
        if grid.gaussians[row, 2] != 0.0:
            places[row] = fronts
            fronts += 1
            backs += grid.gaussians[row, 7] > 0.0
    gaussians, back = np.empty((fronts + backs, 8)), fronts
    for row in range(rows):
        if places[row] >= 0:
            gaussian = gaussians[places[row]]
            assign(gaussian, grid.gaussians[row])
            if gaussian[7] > 0.0:
                gaussian[7] = back
                assign(gaussians[back], grid.gaussians[capacity + row])
                back += 1
    keys, links, kept = np.empty(rows, dtype=np.int64), np.empty((rows, 4), dtype=np.int32), 0
    for row in range(rows):
        is_used = False
        for block in range(4):
            link = grid.links[row, block]
            links[kept, block] = places[link] if link >= 0 else -1
            is_used |= links[kept, block] >= 0
        keys[kept] = grid.keys[row]
        kept += is_used
    compact = Grid(
        np.full(table_size(kept), -1, dtype=np.int32),
        keys[:kept].copy(),
        links[:kept].copy(),
        np.empty((0, 2)),
        np.empty((0, 2, 8)),
        gaussians,
        np.empty(0),
    )
    rehash(compact, kept)
    return compact


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
        options: GaussianOptions,
        capacity: int = INITIAL_CAPACITY,
        neighbourhood: int = NO_NEIGHBOURS,
        faces: bool = True,
    ) -> Ndt:
        """An NDT to which points are added.

        `neighbourhood` is one of NO_NEIGHBOURS, WALL_DIRECTION and WALL_END. With `faces` a wall can have two
        Gaussians, one for each face; see gaussians.py.
        """
        return cls(options.cell, empty_grid(capacity, grid_settings(options, neighbourhood, faces)), 0)

    @classmethod
    def of_scans(
        cls,
        points: Array,
        ends: Indices,
        poses: Array,
        options: GaussianOptions,
        capacity: int = INITIAL_CAPACITY,
        neighbourhood: int = NO_NEIGHBOURS,
    ) -> Ndt:
        """The compact NDT of n scans, moved by `poses` (n, 3), to which no points can be added.

        Scan k has points[ends[k] : ends[k + 1]]. Other arguments as for `empty`.
        """
        settings = grid_settings(options, neighbourhood, faces=True)
        grid = _grid_of_scans(points, ends, poses, 0.5 * options.cell, capacity, settings)
        return cls(options.cell, grid, len(grid.keys))

    @property
    def half(self) -> float:
        """Side (m) of a lattice cell."""
        return 0.5 * self.cell

    def add(self, points: Array, pose: Array) -> None:
        """Add points (m, 2), moved by `pose` (3,)."""
        self.reserve(len(points))
        self.rows = change_points(self.grid, self.rows, self.half, points, pose, 1.0, True)

    def reserve(self, points: int) -> None:
        """Get capacity for a number of new points."""
        self.grid, self.rows = with_capacity(self.grid, self.rows, points)


def grid_settings(options: GaussianOptions, neighbourhood: int, faces: bool) -> Array:
    """`Grid.settings` (13,); the arguments are those of `Ndt.empty`."""
    # One by one, which is faster than many places at a time: many grids are for one match of two scans.
    settings, walls = np.empty(13), options.walls
    settings[MINIMUM], settings[FLOOR] = options.minimum, options.floor
    settings[NEIGHBOURHOOD], settings[FACES] = neighbourhood, faces
    settings[LEAST_RATIO] = options.least_ratio
    settings[MAX_NEIGHBOUR], settings[SIDE_SHARE] = walls.max_neighbour, walls.min_side_share
    settings[MIN_SPACING], settings[MAX_SPACING] = walls.min_spacing, walls.max_spacing
    settings[ELONGATION], settings[COSINE] = walls.min_elongation, walls.min_cosine
    settings[END_SHARE], settings[END_RATIO] = walls.end_share, walls.max_end_ratio
    return settings
