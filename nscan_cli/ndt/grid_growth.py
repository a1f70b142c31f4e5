"""Points of scans are added to the grid of an NDT and removed again ([19]; paper, III-F).

The plane has four overlapping grids, shifted by half a cell against each other. Their common refinement is a
lattice of half cells. A point falls into one lattice cell, and is associated with the Gaussians of the four
2 × 2 blocks that contain the cell. Sums are therefore kept for lattice cells, and a Gaussian is made from
those of its block. They can be subtracted again, so that a map follows the robot.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.ndt.gaussians import make_gaussian
from nscan_cli.ndt.hash_grid import (
    MAX_NEIGHBOUR,
    MAX_SPACING,
    MIN_SPACING,
    NEIGHBOURHOOD,
    OUTDATED,
    WALL_DIRECTION,
    WALL_END,
    Grid,
    empty_grid,
    find_row,
    insert_key,
    pack_key,
    unpack_key,
)
from nscan_cli.ndt.neighbourhood import align_with_neighbourhood, drop_along_wall_information
from nscan_cli.poses import Array

CELLS_PER_POINT = 9
"""Most lattice cells that a point adds: its own and the eight around it."""


@leaf_kernel
def add_points(
    grid: Grid, rows: int, half: float, points: Array, pose: Array, sign: float, touched: NDArray[np.int32]
) -> int:
    """Add (`sign` +1) or remove (−1) points (m, 2), moved by `pose`; returns the number of rows.

    The row of each point is written to `touched` (m,). The Gaussians there have to be made again.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    row, key = -1, -1
    for k in range(points.shape[0]):
        # Along the beam and across it, in the frame of the grid.
        bx = cos * points[k, 0] - sin * points[k, 1]
        by = sin * points[k, 0] + cos * points[k, 1]
        x, y = bx + pose[0], by + pose[1]
        ix, iy = int(np.floor(x / half)), int(np.floor(y / half))
        # Neighbouring beams mostly fall into the same cell.
        if pack_key(ix, iy) != key:
            key = pack_key(ix, iy)
            row = find_row(grid, key)
            if row < 0 or not _has_all_blocks(grid, row):
                row, rows = _insert_with_neighbours(grid, rows, ix, iy)
        touched[k] = row
        facing, sums = grid.facing[row], grid.sums[row]
        # Only an empty cell gets a new normal: points have to be removed from the part that has them.
        if sums[0, 0] + sums[1, 0] < 0.5:
            tx, ty = _scan_tangent(grid.settings, points, k)
            facing[0], facing[1] = -(sin * tx + cos * ty), cos * tx - sin * ty
        part = sums[1 if facing[0] * bx + facing[1] * by > 0.0 else 0]
        dx, dy = x - (ix + 0.5) * half, y - (iy + 0.5) * half
        per_length = sign / max(np.sqrt(bx * bx + by * by), 1e-9)
        part[0] += sign
        part[1] += sign * dx
        part[2] += sign * dy
        part[3] += sign * dx * dx
        part[4] += sign * dx * dy
        part[5] += sign * dy * dy
        part[6] += per_length * bx
        part[7] += per_length * by
        if part[0] < 0.5:
            part[:] = 0.0
    return rows


@kernel
def make_gaussians(grid: Grid, rows: int, touched: NDArray[np.int32], half: float) -> None:
    """Make the Gaussians of the lattice cells in `touched` (m,), which are among the first `rows`."""
    made = np.zeros(rows, dtype=np.bool_)
    previous = -1
    for k in range(touched.shape[0]):
        if touched[k] == previous:
            continue
        previous = touched[k]
        for block in range(4):
            row = grid.links[previous, block]
            if row >= 0 and not made[row]:
                made[row] = True
                make_gaussian(grid, row, half)
    # In loops of their own, which most scans skip.
    for row in range(rows if grid.settings[NEIGHBOURHOOD] == WALL_DIRECTION else 0):
        if made[row]:
            align_with_neighbourhood(grid, row, half)
    for row in range(rows if grid.settings[NEIGHBOURHOOD] == WALL_END else 0):
        if made[row]:
            drop_along_wall_information(grid, row, half)


@kernel
def change_points(
    grid: Grid, rows: int, half: float, points: Array, pose: Array, sign: float, at_once: bool
) -> int:
    """Add or remove points as `add_points`, and make the Gaussians, at once or when they are looked up.

    Gaussians that are made later are not corrected by their neighbourhood. Returns the number of rows.
    """
    touched = np.empty(points.shape[0], dtype=np.int32)
    rows = add_points(grid, rows, half, points, pose, sign, touched)
    if at_once:
        make_gaussians(grid, rows, touched, half)
    else:
        _outdate_gaussians(grid, touched)
    return rows


@leaf_kernel
def _outdate_gaussians(grid: Grid, touched: NDArray[np.int32]) -> None:
    """Mark the Gaussians of all lattice cells in `touched` (m,) as outdated."""
    previous = -1
    for k in range(touched.shape[0]):
        if touched[k] != previous:
            previous = touched[k]
            for block in range(4):
                row = grid.links[previous, block]
                if row >= 0:
                    grid.gaussians[row, 2] = OUTDATED


@leaf_kernel
def _scan_tangent(settings: Array, points: Array, k: int) -> tuple[float, float]:
    """The direction of the surface at point k of a scan (m, 2), from its neighbours; else across its beam."""
    x, y = points[k, 0], points[k, 1]
    nearest, farthest = settings[MIN_SPACING], settings[MAX_SPACING]
    tx = ty = 0.0
    for step in (-1, 1):
        for beside in range(1, int(settings[MAX_NEIGHBOUR]) + 1):
            other = k + step * beside
            if other < 0 or other >= points.shape[0]:
                break
            dx, dy = points[other, 0] - x, points[other, 1] - y
            apart = dx * dx + dy * dy
            if apart > nearest * nearest:
                if apart < farthest * farthest:
                    tx += step * dx
                    ty += step * dy
                break
    if tx == 0.0 and ty == 0.0:
        return -y, x
    return tx, ty


@leaf_kernel
def _has_all_blocks(grid: Grid, row: int) -> bool:
    links = grid.links
    return bool(links[row, 0] >= 0 and links[row, 1] >= 0 and links[row, 2] >= 0 and links[row, 3] >= 0)


@leaf_kernel
def _insert_with_neighbours(grid: Grid, rows: int, ix: int, iy: int) -> tuple[int, int]:
    """Insert a lattice cell that gets its first point, and all cells that share a Gaussian with it."""
    centre = -1
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            row, rows = insert_key(grid, rows, pack_key(ix + dx, iy + dy))
            if dx == 0 and dy == 0:
                centre = row
            for block in range(4):
                bx, by = dx - block % 2, dy - block // 2
                if -1 <= bx <= 0 and -1 <= by <= 0:
                    block_row, rows = insert_key(grid, rows, pack_key(ix + bx, iy + by))
                    grid.links[row, block] = block_row
    return centre, rows


@kernel
def _copied(old: Grid, rows: int, capacity: int) -> tuple[Grid, int]:
    """A new grid with a copy of the first `rows` of an old one, and its number of rows.

    Cells that have no points and no neighbours with points are left out, or a map that moves would grow.
    """
    new, count = empty_grid(capacity, old.settings), 0
    for row in range(rows):
        if old.sums[row, 0, 0] + old.sums[row, 1, 0] > 0.5:
            ix, iy = unpack_key(old.keys[row])
            centre, count = _insert_with_neighbours(new, count, ix, iy)
            assign(new.facing[centre], old.facing[row])
            assign_rows(new.sums[centre], old.sums[row])
    for row in range(count):
        before = find_row(old, new.keys[row])
        gaussian = new.gaussians[row]
        assign(gaussian, old.gaussians[before])
        if gaussian[7] > 0.0:
            other = new.keys.shape[0] + row
            assign(new.gaussians[other], old.gaussians[old.keys.shape[0] + before])
            gaussian[7] = other
    return new, count


@kernel
def with_capacity(grid: Grid, rows: int, points: int) -> tuple[Grid, int]:
    """The grid, or a copy without empty cells, that has capacity for a number of new points; its rows."""
    needed, capacity = CELLS_PER_POINT * points, grid.keys.shape[0]
    if rows + needed <= capacity:
        return grid, rows
    grid, rows = _copied(grid, rows, capacity)
    # With less than half of it free, the next copy would follow soon.
    if rows + needed > capacity // 2:
        grid, rows = _copied(grid, rows, 2 * max(rows + needed, capacity))
    return grid, rows


@kernel
def make_all_gaussians(grid: Grid, rows: int, half: float) -> None:
    """Make the Gaussians of all lattice cells in the first `rows`."""
    make_gaussians(grid, rows, np.arange(rows, dtype=np.int32), half)
