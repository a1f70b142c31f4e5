"""Find the pose of a scan without a good start: branch and bound over a likelihood field.

The field says of each small cell how near it is to a point of the reference; a pose scores the mean of the
cells that the scan's points fall into. Coarser levels of the field hold the greatest value of a square of
cells, so that one look bounds all shifts of a square from above, and whatever cannot beat the best pose
found so far is never looked at (Olson 2009; Hess et al. 2016, section V). The pose found is the best of its
lattice; NDT matching makes it exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.compiled import kernel
from nscan_cli.poses import Array

LEVELS = 4
"""The coarsest level has squares of 2³ cells."""
SPLAT = 2
"""Cells to each side that a point reaches."""


@dataclass(frozen=True)
class SearchOptions:
    """How far, and how finely, a pose is searched."""

    distance: float = 4.5
    """m to each side: two starts that are 1.5 m off, and one that is turned by 30° seen 3 m away."""
    turn: float = 1.1
    """rad to each side: two starts that are turned by 30° each."""
    cell: float = 0.2
    """Side of a cell of the field, m."""
    spread: float = 0.15
    """Standard deviation (m) by which a point is blurred."""
    beams: int = 90
    """A scan with more points is searched with so many of them."""
    lever: float = 15.0
    """A turn moves a point at this distance (m) by one cell from one angle of the search to the next."""


class Field(NamedTuple):
    """A likelihood field and its levels."""

    levels: NDArray[np.float32]
    """(LEVELS, w, h) values in [0, 1]; level l at (ix, iy): the greatest of 2ˡ × 2ˡ cells from there on."""
    x: float
    """m, left border of the first cell."""
    y: float
    cell: float


class Found(NamedTuple):
    """The best pose of a search."""

    score: float
    """In [0, 1]; the score asked for where there is nothing better."""
    pose: Array
    """(3,)"""


def likelihood_field(points: Array, options: SearchOptions) -> Field:
    """The field of reference points (m, 2)."""
    margin = SPLAT * options.cell
    (x, y), (right, top) = points.min(axis=0) - margin, points.max(axis=0) + margin
    shape = (LEVELS, int((right - x) / options.cell) + 2, int((top - y) / options.cell) + 2)
    field = Field(np.zeros(shape, dtype=np.float32), float(x), float(y), options.cell)
    _splat(field, points, options.spread)
    return field


def search(
    field: Field,
    points: Array,
    centre: Array,
    least: float,
    options: SearchOptions,
    without: tuple[Array, float] | None = None,
) -> Found | None:
    """The best pose about `centre` (3,) of a scan with points (m, 2), if it scores more than `least`.

    `without` is a place, as a pose (3,) and a distance (m) from it, where none is looked for.
    """
    some = np.linspace(0, len(points) - 1, min(options.beams, len(points))).astype(np.int64)
    chosen = np.ascontiguousarray(points[some])
    step = options.cell / min(float(np.hypot(chosen[:, 0], chosen[:, 1]).max()), options.lever)
    angles = centre[2] + step * np.arange(-int(options.turn / step), int(options.turn / step) + 1)
    reach, pose = int(options.distance / options.cell), np.empty(3)
    place, away = (centre, -1.0) if without is None else without
    score = _branch_and_bound(field, chosen, centre, angles, reach, least, place, away, pose)
    return Found(score, pose) if score > least else None


@kernel
def _splat(field: Field, points: Array, spread: float) -> None:
    levels, cell = field.levels, field.cell
    for k in range(points.shape[0]):
        cx, cy = int((points[k, 0] - field.x) / cell), int((points[k, 1] - field.y) / cell)
        for ix in range(max(cx - SPLAT, 0), min(cx + SPLAT + 1, levels.shape[1])):
            for iy in range(max(cy - SPLAT, 0), min(cy + SPLAT + 1, levels.shape[2])):
                dx = field.x + (ix + 0.5) * cell - points[k, 0]
                dy = field.y + (iy + 0.5) * cell - points[k, 1]
                value = np.float32(np.exp(-0.5 * (dx * dx + dy * dy) / (spread * spread)))
                levels[0, ix, iy] = max(levels[0, ix, iy], value)
    width, height = levels.shape[1], levels.shape[2]
    for level in range(1, LEVELS):
        half = 1 << (level - 1)
        finer, coarser = levels[level - 1], levels[level]
        for ix in range(width):
            for iy in range(height):
                value = finer[ix, iy]
                if ix + half < width:
                    value = max(value, finer[ix + half, iy])
                    if iy + half < height:
                        value = max(value, finer[ix + half, iy + half])
                if iy + half < height:
                    value = max(value, finer[ix, iy + half])
                coarser[ix, iy] = value


@kernel
def _bound(
    levels: NDArray[np.float32],
    level: int,
    cells: NDArray[np.int32],
    ox: int,
    oy: int,
) -> float:
    """What the shifts (ox, oy) to (ox + 2ˡ − 1, oy + 2ˡ − 1) score at most; at level 0, the score."""
    width, height, beyond = levels.shape[1], levels.shape[2], (1 << level) - 1
    total = 0.0
    for k in range(cells.shape[0]):
        ix, iy = cells[k, 0] + ox, cells[k, 1] + oy
        if ix >= width or iy >= height or ix + beyond < 0 or iy + beyond < 0:
            continue
        # A square that begins before the field has nothing there.
        total += levels[level, max(ix, 0), max(iy, 0)]
    return float(total / cells.shape[0])


@kernel
def _branch_and_bound(
    field: Field,
    points: Array,
    centre: Array,
    angles: Array,
    reach: int,
    least: float,
    place: Array,
    away: float,
    pose: Array,
) -> float:
    """Write the pose (3,) of the best score above `least`; returns that score, or `least`.

    Poses within `away` of the `place` (3,) do not count.
    """
    top = LEVELS - 1
    side = 1 << top
    tiles = (2 * reach) // side + 1
    cells = np.empty((angles.shape[0], points.shape[0], 2), dtype=np.int32)
    bounds = np.empty(angles.shape[0] * tiles * tiles)
    for a in range(angles.shape[0]):
        cos, sin = np.cos(angles[a]), np.sin(angles[a])
        for k in range(points.shape[0]):
            x = cos * points[k, 0] - sin * points[k, 1] + centre[0]
            y = sin * points[k, 0] + cos * points[k, 1] + centre[1]
            cells[a, k, 0] = int(np.floor((x - field.x) / field.cell))
            cells[a, k, 1] = int(np.floor((y - field.y) / field.cell))
        for i in range(tiles):
            for j in range(tiles):
                bound = _bound(field.levels, top, cells[a], i * side - reach, j * side - reach)
                bounds[(a * tiles + i) * tiles + j] = bound
    best = least
    stack, stack_bounds = np.empty((4 * LEVELS, 3), dtype=np.int64), np.empty(4 * LEVELS)
    for tile in np.argsort(-bounds):
        if bounds[tile] <= best:
            break
        a, i, j = tile // (tiles * tiles), (tile // tiles) % tiles, tile % tiles
        stack[0, 0], stack[0, 1], stack[0, 2] = i * side - reach, j * side - reach, top
        stack_bounds[0] = bounds[tile]
        size = 1
        while size > 0:
            size -= 1
            ox, oy, level = stack[size, 0], stack[size, 1], stack[size, 2]
            if stack_bounds[size] <= best:
                continue
            if level == 0:
                x, y = centre[0] + ox * field.cell, centre[1] + oy * field.cell
                if np.hypot(x - place[0], y - place[1]) > away:
                    best = stack_bounds[size]
                    pose[0], pose[1], pose[2] = x, y, angles[a]
                continue
            half, first = 1 << (level - 1), size
            for quarter in range(4):
                bx, by = ox + (quarter & 1) * half, oy + (quarter >> 1) * half
                bound = _bound(field.levels, level - 1, cells[a], bx, by)
                if bound <= best:
                    continue
                # The most promising quarter lies on top.
                at = size
                while at > first and stack_bounds[at - 1] > bound:
                    stack[at], stack_bounds[at] = stack[at - 1], stack_bounds[at - 1]
                    at -= 1
                stack[at, 0], stack[at, 1], stack[at, 2] = bx, by, level - 1
                stack_bounds[at] = bound
                size += 1
    return float(best)
