"""Which Gaussians the points of a scan meet at a pose: looked up once, or kept while the pose changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.compiled import kernel, lean_kernel
from nscan_cli.ndt.table import Grid, find_row, pack, shown
from nscan_cli.poses import Array

BLOCKS = 4
"""A point meets at most so many."""
MET = 7
"""Numbers of a point that meets a Gaussian: R(φ) x, v, and Σ⁻¹ as (xx, xy, yy)."""
GAUSSIAN = 7
"""Numbers of a Gaussian; see Grid."""


@kernel
def room_to_meet(points: int, stride: int) -> Array:
    """Room for what so many points meet; see meet."""
    return np.empty((MET, BLOCKS * (points // stride + 1)))


@lean_kernel
def meet(
    grid: Grid, half: float, points: Array, x: float, y: float, phi: float, stride: int, met: Array
) -> int:
    """Write the numbers of every point that meets a Gaussian to the columns of `met` (7, …); how many do.

    Of the points, every so-manyth counts by `stride`.
    """
    cos, sin = np.cos(phi), np.sin(phi)
    count, row, key = 0, -1, -1
    for k in range(0, points.shape[0], stride):
        rx = cos * points[k, 0] - sin * points[k, 1]
        ry = sin * points[k, 0] + cos * points[k, 1]
        px, py = rx + x, ry + y
        cell = pack(int(np.floor(px / half)), int(np.floor(py / half)))
        # Neighbouring beams mostly fall into the same cell.
        if cell != key:
            key, row = cell, find_row(grid, cell)
        if row < 0:
            continue
        for block in range(BLOCKS):
            link = shown(grid, grid.links[row, block], rx, ry)
            if link < 0:
                continue
            gaussian = grid.gaussians[link]
            # Unsigned, so that nobody asks whether it counts from the end.
            c = np.uint64(count)
            met[0, c], met[1, c] = rx, ry
            met[2, c], met[3, c] = px - gaussian[0], py - gaussian[1]
            met[4, c], met[5, c], met[6, c] = gaussian[2], gaussian[3], gaussian[4]
            count += 1
    return count


class Meeting(NamedTuple):
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
def begin(points: Array) -> Meeting:
    """Room for the meeting of points (m, 2), which have met nothing yet."""
    m = points.shape[0]
    cells = np.full((2, m), np.nan)
    meeting = Meeting(
        np.empty((2, m)), cells, np.empty((2, m)), np.empty((4, m)), np.empty((BLOCKS, GAUSSIAN, m))
    )
    meeting.points[:, :] = points.T
    return meeting


@lean_kernel
def meet_again(grid: Grid, half: float, meeting: Meeting, x: float, y: float, phi: float) -> None:
    """Move the points to the pose (x, y, phi), and look up what those meet that get into another cell."""
    cells, cells_now = meeting.cells, meeting.cells_now
    left = _move(meeting.points, x, y, np.cos(phi), np.sin(phi), half, meeting.moved, cells, cells_now)
    # A short step takes no point into another cell, most of the times.
    for k in range(cells.shape[1] if left else 0):
        ix, iy = cells_now[0, k], cells_now[1, k]
        if ix != cells[0, k] or iy != cells[1, k]:
            cells[0, k], cells[1, k] = ix, iy
            row = find_row(grid, pack(int(ix), int(iy)))
            for block in range(BLOCKS):
                link = -1 if row < 0 else grid.links[row, block]
                link = shown(grid, link, meeting.moved[0, k], meeting.moved[1, k])
                if link < 0:
                    meeting.gaussians[block, :, k] = 0.0
                    continue
                gaussian = grid.gaussians[link]
                for number in range(GAUSSIAN):
                    meeting.gaussians[block, number, k] = gaussian[number]


@lean_kernel
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
