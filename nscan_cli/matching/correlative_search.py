"""Correlative search for the pose of a scan without a good start: branch and bound over a likelihood field.

The score of a pose is the mean over the field's cells that the scan's points fall into. The field's coarser
levels bound the scores of all shifts within a square, so squares that cannot beat the best pose are skipped
(Olson 2009; Hess et al. 2016, section V). The result is the best pose of a lattice; NDT matching refines it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.likelihood_field import (
    GREATEST_SUM,
    LANE_BITS,
    LEVELS,
    TILE_SIDE,
    LikelihoodField,
)
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.matching.tile_sums import tile_sums
from nscan_cli.poses import Array, Indices


class FoundPose(NamedTuple):
    """The best pose of a search."""

    score: float
    """Mean value of the field at the scan's points, in [0, 1]."""
    pose: Array
    """(3,)"""


class Search:
    """A search for the pose of a scan with points (m, 2) near `centre` (3,), by upper bounds of scores."""

    def __init__(self, field: LikelihoodField, points: Array, centre: Array, options: SearchOptions) -> None:
        beams = min(options.beams, len(points), GREATEST_SUM // field.unit)
        chosen = np.ascontiguousarray(points[np.linspace(0, len(points) - 1, beams).astype(np.int64)])
        step = options.cell / min(float(np.hypot(chosen[:, 0], chosen[:, 1]).max()), options.lever)
        turns = int(options.turn / step)
        angles = centre[2] + step * np.arange(-turns, turns + 1)
        cells = _point_cells(field.x, field.y, field.cell, chosen, centre, angles)
        self._centre, self._greatest = centre, beams * field.unit
        self._tiles = tile_sums(field.coarsest, cells, int(options.distance / options.cell))
        self._lattice = field.finest, field.quarters, field.cell, field.unit, cells, centre, angles

    def best(self, least: float, without: tuple[Array, float] | None = None) -> FoundPose | None:
        """The best pose that scores more than `least`; None if there is none.

        `without` excludes poses within a distance (m) of a pose (3,).
        """
        pose = np.empty(3)
        place, away = (self._centre, -1.0) if without is None else without
        sums, first = self._tiles
        flat = sums.ravel()
        tiles = np.flatnonzero(flat > int(max(least, 0.0) * self._greatest))
        # Sorted here: numba takes a second to compile a sort. The complement has the greatest sum first.
        tiles = tiles[np.argsort(~flat[tiles], kind="stable")]
        score = _branch_and_bound(*self._lattice, sums, *first, tiles, least, place, away, pose)
        return FoundPose(score, pose) if score > least else None


def search(
    field: LikelihoodField, points: Array, centre: Array, least: float, options: SearchOptions
) -> FoundPose | None:
    """The best pose near `centre` (3,) of a scan with points (m, 2), if it scores more than `least`."""
    return Search(field, points, centre, options).best(least)


@kernel
def _point_cells(
    left: float, bottom: float, cell: float, points: Array, centre: Array, angles: Array
) -> NDArray[np.int32]:
    """(a, 2, m) the cells of a field that the points are in at the centre, with each of the angles (a,)."""
    cells = np.empty((angles.shape[0], 2, points.shape[0]), dtype=np.int32)
    for a in range(angles.shape[0]):
        cos, sin = np.cos(angles[a]), np.sin(angles[a])
        for k in range(points.shape[0]):
            x = cos * points[k, 0] - sin * points[k, 1] + centre[0]
            y = sin * points[k, 0] + cos * points[k, 1] + centre[1]
            cells[a, 0, k] = TILE_SIDE + int(np.floor((x - left) / cell))
            cells[a, 1, k] = TILE_SIDE + int(np.floor((y - bottom) / cell))
    return cells


@leaf_kernel
def _quarter_sums(quarters: NDArray[np.int64], cells: NDArray[np.int32], ox: int, oy: int) -> int:
    """The sums of the greatest values (w, h) of four quarters at the cells (2, m) shifted by (ox, oy).

    Four sums as one number, like the values: what each beam costs is one look into memory.
    """
    right, top, stride = quarters.shape[0] - 1, quarters.shape[1] - 1, quarters.shape[1]
    flat, total = quarters.reshape(-1), 0
    for k in range(cells.shape[1]):
        ix, iy = min(max(cells[0, k] + ox, 0), right), min(max(cells[1, k] + oy, 0), top)
        # An index without sign is not counted from the end.
        total += flat[np.uint64(ix * stride + iy)]
    return total


@kernel
def _four_scores(
    finest: NDArray[np.float32], cells: NDArray[np.int32], ox: int, oy: int, scores: Array
) -> None:
    """Write the scores (4,) of the cells (2, m) at the shift (ox, oy) and one on in x, in y and in both."""
    right, top = finest.shape[0] - 1, finest.shape[1] - 1
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(cells.shape[1]):
        ix, iy = cells[0, k] + ox, cells[1, k] + oy
        x0, y0 = min(max(ix, 0), right), min(max(iy, 0), top)
        x1, y1 = min(max(ix + 1, 0), right), min(max(iy + 1, 0), top)
        a += finest[x0, y0]
        b += finest[x1, y0]
        c += finest[x0, y1]
        d += finest[x1, y1]
    scores[0], scores[1], scores[2], scores[3] = a, b, c, d
    for quarter in range(4):
        scores[quarter] /= cells.shape[1]


@kernel
def _branch_and_bound(
    finest: NDArray[np.float32],
    quarters: NDArray[np.int64],
    cell: float,
    unit: int,
    cells: NDArray[np.int32],
    centre: Array,
    angles: Array,
    sums: NDArray[np.uint16],
    first_x: int,
    first_y: int,
    tiles: Indices,
    least: float,
    place: Array,
    away: float,
    pose: Array,
) -> float:
    """Write the pose (3,) of the best score above `least`; returns that score, or `least`.

    `tiles` are those with greater `sums` (a, t, u), from the greatest on; the first one begins at the shift
    (first_x, first_y). Poses within `away` (m) of `place` (3,) do not count.
    """
    columns, rows, greatest = sums.shape[1], sums.shape[2], cells.shape[2] * unit
    best = least
    stack, scores = np.empty((4 * LEVELS, 4), dtype=np.int64), np.empty(4)
    for tile in tiles:
        a, i, j = tile // (columns * rows), tile // rows % columns, tile % rows
        if sums[a, i, j] <= best * greatest:
            break
        stack[0, 0], stack[0, 1] = first_x + i * TILE_SIDE, first_y + j * TILE_SIDE
        stack[0, 2], stack[0, 3] = LEVELS, sums[a, i, j]
        size = 1
        while size > 0:
            size -= 1
            ox, oy, level = stack[size, 0], stack[size, 1], stack[size, 2]
            if stack[size, 3] <= best * greatest:
                continue
            half, top = 1 << (level - 1), size
            if level == 1:
                _four_scores(finest, cells[a], ox, oy, scores)
                for quarter in range(4):
                    if scores[quarter] <= best:
                        continue
                    ix, iy = ox + (quarter & 1), oy + (quarter >> 1)
                    x, y = centre[0] + ix * cell, centre[1] + iy * cell
                    if np.hypot(x - place[0], y - place[1]) > away:
                        best = scores[quarter]
                        pose[0], pose[1], pose[2] = x, y, angles[a]
                continue
            four = _quarter_sums(quarters[level - 2], cells[a], ox, oy)
            for quarter in range(4):
                bound = (four >> (LANE_BITS * quarter)) & GREATEST_SUM
                if bound <= best * greatest:
                    continue
                # The quarter with the greatest bound lies on top.
                at = size
                while at > top and stack[at - 1, 3] > bound:
                    stack[at, 0], stack[at, 1] = stack[at - 1, 0], stack[at - 1, 1]
                    stack[at, 2], stack[at, 3] = stack[at - 1, 2], stack[at - 1, 3]
                    at -= 1
                stack[at, 0], stack[at, 1] = ox + (quarter & 1) * half, oy + (quarter >> 1) * half
                stack[at, 2], stack[at, 3] = level - 1, bound
                size += 1
    return float(best)
