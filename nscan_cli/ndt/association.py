"""Which Gaussians the points of a scan meet at a pose: looked up once, or kept while the pose changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel, numba_inline_kernel
from nscan_cli.ndt.gaussians import make_gaussian
from nscan_cli.ndt.hash_grid import OUTDATED, Grid, find_row, pack, shown
from nscan_cli.poses import Array

BLOCKS = 4
"""A point meets at most so many."""
MET = 7
"""Numbers of a point that meets a Gaussian; see RoomToMeet."""
GAUSSIAN = 7
"""Numbers of a Gaussian; see Grid."""


class RoomToMeet(NamedTuple):
    """Room for n points and what they meet."""

    moved: Array
    """(4, n) R(φ) x, and the lattice coordinates of x'."""
    met: Array
    """(7, 4 n) of each point on each Gaussian: R(φ) x, v, and Σ⁻¹ as (xx, xy, yy)."""


@kernel
def room_to_meet(points: int, stride: int) -> RoomToMeet:
    """Room for so many points, of which every so-manyth counts by `stride`."""
    n = (points + stride - 1) // stride
    return RoomToMeet(np.empty((4, n)), np.empty((MET, BLOCKS * n)))


@leaf_kernel
def associate(
    grid: Grid, half: float, points: Array, x: float, y: float, phi: float, stride: int, room: RoomToMeet
) -> int:
    """Write the numbers of every point that meets a Gaussian to the columns of `room.met`; how many do.

    Of the points (m, 2), every so-manyth counts by `stride`.
    """
    moved, met = room.moved, room.met
    n = (points.shape[0] + stride - 1) // stride
    # All at first, side by side in lanes: where a look-up ends nobody can foresee, and what comes after it
    # waits.
    _place(points, x, y, np.cos(phi), np.sin(phi), half, stride, n, moved)
    count, row, key = 0, -1, -1
    for k in range(n):
        cell = pack(int(moved[2, k]), int(moved[3, k]))
        # Neighbouring beams mostly fall into the same cell.
        if cell != key:
            key, row = cell, find_row(grid, cell)
        if row < 0:
            continue
        rx, ry = moved[0, k], moved[1, k]
        for block in range(BLOCKS):
            link = shown(grid, grid.links[row, block], rx, ry)
            if link < 0:
                continue
            gaussian = grid.gaussians[link]
            # Unsigned, so that nobody asks whether it counts from the end.
            c = np.uint64(count)
            met[0, c], met[1, c] = rx, ry
            met[2, c], met[3, c] = rx + x - gaussian[0], ry + y - gaussian[1]
            met[4, c], met[5, c], met[6, c] = gaussian[2], gaussian[3], gaussian[4]
            count += 1
    return count


@leaf_kernel
def _place(
    points: Array, x: float, y: float, cos: float, sin: float, half: float, stride: int, n: int, moved: Array
) -> None:
    """Write where n points and their cells are; see RoomToMeet."""
    for k in range(n):
        at = np.uint64(k * stride)
        rx = cos * points[at, 0] - sin * points[at, 1]
        ry = sin * points[at, 0] + cos * points[at, 1]
        moved[0, k], moved[1, k] = rx, ry
        moved[2, k], moved[3, k] = np.floor((rx + x) / half), np.floor((ry + y) / half)


class Association(NamedTuple):
    """m points where they were last, and the Gaussians of the lattice cells there."""

    points: Array
    """(2, m) in their own frame."""
    cells: Array
    """(2, m) lattice coordinates; nan before the first time."""
    cells_now: Array
    """(2, m) the same, before what is there is looked up."""
    moved: Array
    """(4, m) R(φ) x, and x'."""
    gaussians: Array
    """(4, 7, m) those of the four blocks; all 0 where there is none."""


@kernel
def begin(points: Array) -> Association:
    """Room for the meeting of points (m, 2), which have met nothing yet."""
    m = points.shape[0]
    cells = np.full((2, m), np.nan)
    meeting = Association(
        np.empty((2, m)), cells, np.empty((2, m)), np.empty((4, m)), np.empty((BLOCKS, GAUSSIAN, m))
    )
    for k in range(m):
        meeting.points[0, k], meeting.points[1, k] = points[k, 0], points[k, 1]
    return meeting


@leaf_kernel
def associate_again(grid: Grid, half: float, meeting: Association, x: float, y: float, phi: float) -> None:
    """Move the points to the pose (x, y, phi), and look up what those meet that get into another cell.

    Gaussians there that are outdated are made anew.
    """
    cells, cells_now = meeting.cells, meeting.cells_now
    left = _move(meeting.points, x, y, np.cos(phi), np.sin(phi), half, meeting.moved, cells, cells_now)
    # A short step takes no point into another cell, most of the times.
    for k in range(cells.shape[1] if left else 0):
        ix, iy = cells_now[0, k], cells_now[1, k]
        if ix != cells[0, k] or iy != cells[1, k]:
            cells[0, k], cells[1, k] = ix, iy
            row = find_row(grid, pack(int(ix), int(iy)))
            if row >= 0:
                _make_outdated(grid, row, half)
            for block in range(BLOCKS):
                link = -1 if row < 0 else grid.links[row, block]
                link = shown(grid, link, meeting.moved[0, k], meeting.moved[1, k])
                if link < 0:
                    meeting.gaussians[block, :, k] = 0.0
                    continue
                gaussian = grid.gaussians[link]
                for number in range(GAUSSIAN):
                    meeting.gaussians[block, number, k] = gaussian[number]


@numba_inline_kernel
def _make_outdated(grid: Grid, row: int, half: float) -> None:
    """Make the Gaussians of a lattice cell anew that are outdated."""
    for block in range(BLOCKS):
        link = grid.links[row, block]
        if link >= 0 and grid.gaussians[link, 2] == OUTDATED:
            make_gaussian(grid, link, half)


@leaf_kernel
def count_inliers(meeting: Association, bound: float) -> int:
    """How many points are within a Mahalanobis distance² of `bound` of a Gaussian that they meet."""
    moved, gaussians = meeting.moved, meeting.gaussians
    count = 0
    for k in range(moved.shape[1]):
        on = False
        for block in range(BLOCKS):
            vx, vy = moved[2, k] - gaussians[block, 0, k], moved[3, k] - gaussians[block, 1, k]
            xx, xy, yy = gaussians[block, 2, k], gaussians[block, 3, k], gaussians[block, 4, k]
            shows = gaussians[block, 5, k] * moved[0, k] + gaussians[block, 6, k] * moved[1, k] <= 0.0
            # Without `and`, which would be a branch.
            on |= shows & (xx > 0.0) & (xx * vx * vx + 2 * xy * vx * vy + yy * vy * vy < bound)
        count += on
    return count


@leaf_kernel
def _move(
    points: Array,
    x: float,
    y: float,
    cos: float,
    sin: float,
    half: float,
    moved: Array,
    cells: Array,
    cells_now: Array,
) -> int:
    """Write where the points and their cells are; how many have left their cell."""
    left = 0
    for k in range(points.shape[1]):
        rx = cos * points[0, k] - sin * points[1, k]
        ry = sin * points[0, k] + cos * points[1, k]
        ix, iy = np.floor((rx + x) / half), np.floor((ry + y) / half)
        moved[0, k], moved[1, k], moved[2, k], moved[3, k] = rx, ry, rx + x, ry + y
        cells_now[0, k], cells_now[1, k] = ix, iy
        left += (ix != cells[0, k]) | (iy != cells[1, k])
    return left
