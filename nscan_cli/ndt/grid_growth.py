"""The grid of an NDT: how it grows and shrinks by the points of scans ([19]; paper, III-F).

The plane is cut into four overlapping grids, shifted by half a cell against each other. Their common
refinement is a lattice of half cells: a point falls into one lattice cell, and the four Gaussians that it
meets are those of the 2 × 2 blocks of lattice cells around it. The sums of a point are therefore kept once,
in its lattice cell, and a Gaussian is made from the sums of its four. Sums can be taken away again, which
lets a map follow the robot.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.assign import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.ndt.gaussians import make_gaussian
from nscan_cli.ndt.hash_grid import (
    AROUND,
    OPEN,
    OUTDATED,
    STRAIGHT,
    Grid,
    empty_grid,
    find_row,
    insert,
    pack,
    unpack,
)
from nscan_cli.ndt.neighbourhood import drop_along_wall_information, straighten
from nscan_cli.ndt.scan_tangents import tangent
from nscan_cli.poses import Array

NEW_NEIGHBOURS = 9
"""A point in new land creates at most its own lattice cell and the eight around it."""


@leaf_kernel
def add_points(
    grid: Grid, rows: int, half: float, points: Array, pose: Array, sign: float, touched: NDArray[np.int32]
) -> int:
    """Add (sign +1) or take away (−1) points (m, 2), moved by `pose`; returns the number of rows.

    The row of each point is written to `touched` (m,); the Gaussians there are to be made again.
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
        if pack(ix, iy) != key:
            key = pack(ix, iy)
            row = find_row(grid, key)
            if row < 0 or not _is_settled(grid, row):
                row, rows = _settle(grid, rows, ix, iy)
        touched[k] = row
        facing, sums = grid.facing[row], grid.sums[row]
        # What is subtracted finds the part that it was added to: an empty cell alone chooses anew.
        if sums[0, 0] + sums[1, 0] < 0.5:
            tx, ty = tangent(points, k)
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
    """Make the Gaussians of all lattice cells in `touched` (m,), of the first `rows`."""
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
    # On its own: what is done for few scans would slow down what is done for all.
    for row in range(rows if grid.making[AROUND] == STRAIGHT else 0):
        if made[row]:
            straighten(grid, row, half)
    for row in range(rows if grid.making[AROUND] == OPEN else 0):
        if made[row]:
            drop_along_wall_information(grid, row, half)


@kernel
def change(
    grid: Grid,
    rows: int,
    half: float,
    points: Array,
    pose: Array,
    sign: float,
    at_once: bool,
) -> int:
    """Both: the sums, and the Gaussians made of them; when they are met first, if not `at_once`.

    Those that are made later do not know their surroundings.
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
    """Have the Gaussians of all lattice cells in `touched` (m,) made anew when they are met."""
    previous = -1
    for k in range(touched.shape[0]):
        if touched[k] != previous:
            previous = touched[k]
            for block in range(4):
                row = grid.links[previous, block]
                if row >= 0:
                    grid.gaussians[row, 2] = OUTDATED


@leaf_kernel
def _is_settled(grid: Grid, row: int) -> bool:
    links = grid.links
    return bool(links[row, 0] >= 0 and links[row, 1] >= 0 and links[row, 2] >= 0 and links[row, 3] >= 0)


@leaf_kernel
def _settle(grid: Grid, rows: int, ix: int, iy: int) -> tuple[int, int]:
    """Make a lattice cell that gets its first point, and all cells that share a Gaussian with it."""
    centre = -1
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            row, rows = insert(grid, rows, pack(ix + dx, iy + dy))
            if dx == 0 and dy == 0:
                centre = row
            for block in range(4):
                bx, by = dx - block % 2, dy - block // 2
                if -1 <= bx <= 0 and -1 <= by <= 0:
                    block_row, rows = insert(grid, rows, pack(ix + bx, iy + by))
                    grid.links[row, block] = block_row
    return centre, rows


@kernel
def take_over(old: Grid, rows: int, new: Grid) -> int:
    """Enter what is in the first `rows` of a grid into an empty one, which has room; returns its rows.

    Cells without points, far from any that has some, are left behind. A map that moves on would else grow.
    """
    count = 0
    for row in range(rows):
        if old.sums[row, 0, 0] + old.sums[row, 1, 0] > 0.5:
            ix, iy = unpack(old.keys[row])
            centre, count = _settle(new, count, ix, iy)
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
    return count


@kernel
def _renewed(old: Grid, rows: int, capacity: int) -> tuple[Grid, int]:
    """What is in the first `rows` of a grid in a new one, and its number of rows."""
    new = empty_grid(capacity, old.making)
    return new, take_over(old, rows, new)


@kernel
def with_room(grid: Grid, rows: int, points: int) -> tuple[Grid, int]:
    """The grid, or a new one that has room for so many more points. Cells that have become empty go first."""
    room, capacity = NEW_NEIGHBOURS * points, grid.keys.shape[0]
    if rows + room <= capacity:
        return grid, rows
    grid, rows = _renewed(grid, rows, capacity)
    # Half must be free, or it would have to be done again before long.
    if rows + room > capacity // 2:
        grid, rows = _renewed(grid, rows, 2 * max(rows + room, capacity))
    return grid, rows


@kernel
def gathered(
    grid: Grid, rows: int, half: float, points: Array, ends: NDArray[np.int64], poses: Array
) -> tuple[Grid, int]:
    """The grid, and its number of rows, with n scans added, moved by `poses` (n, 3).

    Scan k has points[ends[k] : ends[k + 1]]. The Gaussians are left to be made.
    """
    touched = np.empty(points.shape[0], dtype=np.int32)
    for k in range(poses.shape[0]):
        scan = points[ends[k] : ends[k + 1]]
        grid, rows = with_room(grid, rows, scan.shape[0])
        rows = add_points(grid, rows, half, scan, poses[k], 1.0, touched)
    return grid, rows


@kernel
def make_all(grid: Grid, rows: int, half: float) -> None:
    """Make the Gaussians of all lattice cells in the first `rows`."""
    make_gaussians(grid, rows, np.arange(rows, dtype=np.int32), half)
