"""Correlative search for the pose of a scan without a good start: branch and bound over a likelihood field.

A cell of the field has a greater value the nearer it is to a point of the reference. The score of a pose is
the mean over the cells that the scan's points fall into. Coarser levels of the field hold the maximum of a
square of cells, which bounds the scores of all shifts within the square, so squares that cannot beat the best
pose are skipped (Olson 2009; Hess et al. 2016, section V). The result is the best pose of a lattice; NDT
matching refines it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, Indices

FIELD_LEVELS = 5
"""Levels of a field. Like the three constants below, it is a part of the layout of a field's arrays."""
PAD = 1 << (FIELD_LEVELS - 1)
"""Cells on a side of a square of the coarsest level."""
LANES = 8
"""Numbers that are summed or compared side by side."""
SPLAT = 2
"""Cells to each side that a point raises."""


@dataclass(frozen=True)
class SearchOptions:
    """How far and how finely a pose is searched."""

    distance: float = 4.5
    """Greatest shift to each side, m. The default covers two scans 3 m apart whose starts are 1.5 m off, one
    of them also turned by 30°. A larger value takes longer, and finds poses farther away."""
    turn: float = 1.1
    """Greatest rotation to each side, rad. The default covers two starts that are turned by 30° each. A
    larger value takes longer, and finds poses that are turned more."""
    cell: float = 0.2
    """Side of a cell of the field and of the lattice of poses, m. Larger cells are faster and less exact."""
    spread: float = 0.15
    """Standard deviation by which points are blurred, m. With a larger value poses near each other score
    alike."""
    beams: int = 90
    """Most points of a scan that are used. More take longer, and tell similar places apart better."""
    lever: float = 15.0
    """Distance at which the step between two angles moves a point by one cell, m. A larger value gives a
    finer step, which takes longer."""


class LikelihoodField(NamedTuple):
    """A likelihood field and its levels. It has a border of zeros, PAD cells before and one behind."""

    levels: NDArray[np.float32]
    """(FIELD_LEVELS − 1, w, h) values in [0, 1]; level l has at (ix, iy) the maximum of 2ˡ × 2ˡ cells from
    there."""
    coarsest: NDArray[np.float32]
    """(PAD, w, ⌈h / PAD⌉ + 2 LANES) the last level; [r, ix, LANES + q] is its value at (ix, PAD q + r), so
    that squares side by side are neighbours."""
    x: float
    """Left border of the cells with index PAD, m."""
    y: float
    """Lower border of the cells with index PAD, m."""
    cell: float
    """Side of a cell, m."""


class FoundPose(NamedTuple):
    """The best pose of a search."""

    score: float
    """Mean value of the field at the scan's points, in [0, 1]."""
    pose: Array
    """(3,)"""


def likelihood_field(points: Array, options: SearchOptions) -> LikelihoodField:
    """The field of reference points (m, 2)."""
    margin = SPLAT * options.cell
    (left, right), (bottom, top) = ((float(each.min()), float(each.max())) for each in points.T)
    x, y = left - margin, bottom - margin
    width, height = (
        int((end - begin) / options.cell) + 2 for begin, end in ((x, right + margin), (y, top + margin))
    )
    levels = np.zeros((FIELD_LEVELS - 1, width + PAD + 1, height + PAD + 1), dtype=np.float32)
    coarsest = np.zeros((PAD, width + PAD + 1, -(-levels.shape[2] // PAD) + 2 * LANES), dtype=np.float32)
    field = LikelihoodField(levels, coarsest, x, y, options.cell)
    _splat(field, points, options.spread)
    for level in range(1, FIELD_LEVELS - 1):
        _coarsen(levels[level - 1], 1 << (level - 1), levels[level])
    last = np.empty_like(levels[-1])
    _coarsen(levels[-1], PAD // 2, last)
    for offset in range(PAD):
        column = last[:, offset::PAD]
        coarsest[offset, :, LANES : LANES + column.shape[1]] = column
    return field


class Search:
    """A search for the pose of a scan with points (m, 2) near `centre` (3,), by upper bounds of scores."""

    def __init__(self, field: LikelihoodField, points: Array, centre: Array, options: SearchOptions) -> None:
        indices = np.linspace(0, len(points) - 1, min(options.beams, len(points))).astype(np.int64)
        chosen = np.ascontiguousarray(points[indices])
        step = options.cell / min(float(np.hypot(chosen[:, 0], chosen[:, 1]).max()), options.lever)
        turns = int(options.turn / step)
        angles = centre[2] + step * np.arange(-turns, turns + 1)
        steps = int(options.distance / options.cell)
        cells = _point_cells(field, chosen, centre, angles)
        self._centre = centre
        self._lattice = field, cells, centre, angles, steps
        sums, count = _tile_bounds(field.coarsest, cells, steps).astype(np.float64), cells.shape[1]
        # Rounding may take so much from the mean of numbers up to 1.
        self._tile_bounds = sums / count + count * float(np.finfo(np.float32).eps)

    def best(self, least: float, without: tuple[Array, float] | None = None) -> FoundPose | None:
        """The best pose that scores more than `least`; None if there is none.

        `without` excludes poses within a distance (m) of a pose (3,).
        """
        pose = np.empty(3)
        place, away = (self._centre, -1.0) if without is None else without
        bounds = self._tile_bounds.ravel()
        tiles = np.flatnonzero(bounds > least)
        # Sorted here: numba takes a second to compile a sort.
        tiles = tiles[np.argsort(-bounds[tiles], kind="stable")]
        score = _branch_and_bound(*self._lattice, self._tile_bounds, tiles, least, place, away, pose)
        return FoundPose(score, pose) if score > least else None


def search(
    field: LikelihoodField, points: Array, centre: Array, least: float, options: SearchOptions
) -> FoundPose | None:
    """The best pose near `centre` (3,) of a scan with points (m, 2), if it scores more than `least`."""
    return Search(field, points, centre, options).best(least)


@kernel
def _splat(field: LikelihoodField, points: Array, spread: float) -> None:
    """Write the finest level, from the nearest point within SPLAT cells."""
    finest, cell = field.levels[0], field.cell
    width, height = finest.shape[0] - PAD - 1, finest.shape[1] - PAD - 1
    squares = np.full((width + 2 * SPLAT, height + SPLAT + LANES), np.inf)
    dy2 = np.full(LANES, np.inf)
    for k in range(points.shape[0]):
        cx, cy = int((points[k, 0] - field.x) / cell), int((points[k, 1] - field.y) / cell)
        for j in range(2 * SPLAT + 1):
            dy = field.y + (cy + j - SPLAT + 0.5) * cell - points[k, 1]
            dy2[j] = dy * dy
        for i in range(2 * SPLAT + 1):
            dx = field.x + (cx + i - SPLAT + 0.5) * cell - points[k, 0]
            row = squares[cx + i, cy : cy + LANES]
            for j in range(LANES):
                square = dx * dx + dy2[j]
                row[j] = square if square < row[j] else row[j]
    for ix in range(width):
        for iy in range(height):
            square = squares[ix + SPLAT, iy + SPLAT]
            if square < np.inf:
                finest[ix + PAD, iy + PAD] = np.exp(-0.5 * square / (spread * spread))


@kernel
def _coarsen(finer: NDArray[np.float32], half: int, coarser: NDArray[np.float32]) -> None:
    """Write a level with squares of 2 · `half` cells on a side, from one with squares of `half` cells."""
    width, height = finer.shape
    for ix in range(width):
        here, there, row = finer[ix], finer[min(ix + half, width - 1)], coarser[ix]
        for iy in range(height):
            row[iy] = here[iy] if here[iy] > there[iy] else there[iy]
        for iy in range(height - half):
            row[iy] = row[iy] if row[iy] > row[iy + half] else row[iy + half]


@kernel
def _point_cells(field: LikelihoodField, points: Array, centre: Array, angles: Array) -> NDArray[np.int32]:
    """(a, m, 2) the cells that the points fall into at the centre, with each of the angles (a,)."""
    cells = np.empty((angles.shape[0], points.shape[0], 2), dtype=np.int32)
    for a in range(angles.shape[0]):
        cos, sin = np.cos(angles[a]), np.sin(angles[a])
        for k in range(points.shape[0]):
            x = cos * points[k, 0] - sin * points[k, 1] + centre[0]
            y = sin * points[k, 0] + cos * points[k, 1] + centre[1]
            cells[a, k, 0] = PAD + int(np.floor((x - field.x) / field.cell))
            cells[a, k, 1] = PAD + int(np.floor((y - field.y) / field.cell))
    return cells


@kernel
def _tile_bounds(coarsest: NDArray[np.float32], cells: NDArray[np.int32], reach: int) -> NDArray[np.float32]:
    """(a, t, t) upper bounds of the field's sums in squares of PAD × PAD shifts, from −`reach` cells on."""
    tiles = (2 * reach) // PAD + 1
    lanes = -(-tiles // LANES)
    width, height = coarsest.shape[1], coarsest.shape[2]
    # In single precision twice as many numbers are summed at once.
    bounds = np.zeros((cells.shape[0], tiles, lanes * LANES), dtype=np.float32)
    for a in range(cells.shape[0]):
        for k in range(cells.shape[1]):
            ix, iy = cells[a, k, 0] - reach, cells[a, k, 1] - reach
            for lane in range(lanes):
                first = iy // PAD + LANES * (lane + 1)
                if first <= 0 or first + LANES >= height:
                    continue
                for i in range(max(-(ix // PAD), 0), tiles):
                    if ix + i * PAD >= width:
                        break
                    row = coarsest[iy % PAD, ix + i * PAD, first : first + LANES]
                    total = bounds[a, i, lane * LANES : (lane + 1) * LANES]
                    for j in range(LANES):
                        total[j] += row[j]
    return bounds[:, :, :tiles]


@kernel
def _quarter_bounds(
    level: NDArray[np.float32], half: int, cells: NDArray[np.int32], ox: int, oy: int, bounds: Array
) -> None:
    """Write upper bounds (4,) of the scores of the four squares of `half` × `half` shifts from (ox, oy) on.

    x varies fastest. For single shifts they are the scores.
    """
    right, top = level.shape[0] - 1, level.shape[1] - 1
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(cells.shape[0]):
        ix, iy = cells[k, 0] + ox, cells[k, 1] + oy
        x0, y0 = min(max(ix, 0), right), min(max(iy, 0), top)
        x1, y1 = min(max(ix + half, 0), right), min(max(iy + half, 0), top)
        a += level[x0, y0]
        b += level[x1, y0]
        c += level[x0, y1]
        d += level[x1, y1]
    bounds[0], bounds[1], bounds[2], bounds[3] = a, b, c, d
    for quarter in range(4):
        bounds[quarter] /= cells.shape[0]


@kernel
def _branch_and_bound(
    field: LikelihoodField,
    cells: NDArray[np.int32],
    centre: Array,
    angles: Array,
    reach: int,
    tile_bounds: Array,
    tiles: Indices,
    least: float,
    place: Array,
    away: float,
    pose: Array,
) -> float:
    """Write the pose (3,) of the best score above `least`; returns that score, or `least`.

    `tiles` are the squares with greater bounds (a, t, t), from the greatest on. Poses within `away` (m) of
    `place` (3,) do not count.
    """
    side = tile_bounds.shape[1]
    best = least
    stack, stack_bounds = np.empty((4 * FIELD_LEVELS, 3), dtype=np.int64), np.empty(4 * FIELD_LEVELS)
    quarters = np.empty(4)
    for tile in tiles:
        a, i, j = tile // (side * side), (tile // side) % side, tile % side
        if tile_bounds[a, i, j] <= best:
            break
        stack[0, 0], stack[0, 1], stack[0, 2] = i * PAD - reach, j * PAD - reach, FIELD_LEVELS - 1
        stack_bounds[0] = tile_bounds[a, i, j]
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
            _quarter_bounds(field.levels[level - 1], half, cells[a], ox, oy, quarters)
            for quarter in range(4):
                bound = quarters[quarter]
                if bound <= best:
                    continue
                # The quarter with the greatest bound lies on top.
                at = size
                while at > first and stack_bounds[at - 1] > bound:
                    stack[at], stack_bounds[at] = stack[at - 1], stack_bounds[at - 1]
                    at -= 1
                stack[at, 0], stack[at, 1] = ox + (quarter & 1) * half, oy + (quarter >> 1) * half
                stack[at, 2], stack_bounds[at] = level - 1, bound
                size += 1
    return float(best)
