"""Likelihood fields: how near every place is to a point of the reference, for searches by branch and bound.

A cell has a greater value the nearer it is to a point. Of every square of cells the greatest value is known,
which bounds the scores of all shifts within the square (Olson 2009; Hess et al. 2016, section V).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array

LEVELS = 4
"""A square of the level l has 2ˡ cells on a side; the coarsest level is this one. Like the three constants
below, it is a part of the layout of a field's arrays."""
TILE_SIDE = 1 << LEVELS
"""Cells on a side of a square of the coarsest level."""
LANES = 8
"""Numbers that are compared side by side."""
SPLAT = 2
"""Cells to each side that a point raises."""
LANE_BITS = 16
"""Bits for each of four numbers that are summed as one."""
GREATEST_SUM = (1 << LANE_BITS) - 1


class LikelihoodField(NamedTuple):
    """A likelihood field and its levels. It has a border of zeros, TILE_SIDE cells before and one behind.

    Squares begin at their cell (ix, iy). Their greatest values are rounded up to whole `unit`s, so that sums
    are of small integers.
    """

    finest: NDArray[np.float32]
    """(w, h) values in [0, 1]"""
    quarters: NDArray[np.int64]
    """(LEVELS − 1, w, h) the greatest values of the four quarters of squares of the levels from 2 on. Each
    has LANE_BITS bits, those of the quarters farther on in x, in y and in both above those of the first."""
    coarsest: NDArray[np.uint16]
    """(w, h) the greatest values of the squares of the coarsest level."""
    x: float
    """Left border of the cells with index TILE_SIDE, m."""
    y: float
    """Lower border of the cells with index TILE_SIDE, m."""
    cell: float
    """Side of a cell, m."""
    unit: int
    """What stands for a value of 1: so much that all beams of a scan sum up to GREATEST_SUM at most."""


def likelihood_field(points: Array, options: SearchOptions) -> LikelihoodField:
    """The field of reference points (m, 2)."""
    margin = SPLAT * options.cell
    (left, right), (bottom, top) = ((float(each.min()), float(each.max())) for each in points.T)
    x, y = left - margin, bottom - margin
    width, height = (
        int((end - begin) / options.cell) + 2 for begin, end in ((x, right + margin), (y, top + margin))
    )
    unit = max(GREATEST_SUM // options.beams, 1)
    finest = np.zeros((width + TILE_SIDE + 1, height + TILE_SIDE + 1), dtype=np.float32)
    _splat(finest, points, x, y, options.cell, options.spread)
    quarters, coarsest = _levels(finest, unit)
    return LikelihoodField(finest, quarters, coarsest, x, y, options.cell, unit)


@kernel
def _splat(
    finest: NDArray[np.float32], points: Array, left: float, bottom: float, cell: float, spread: float
) -> None:
    """Write the values of the cells, from the nearest point within SPLAT cells."""
    width, height = finest.shape[0] - TILE_SIDE - 1, finest.shape[1] - TILE_SIDE - 1
    squares = np.full((width + 2 * SPLAT, height + SPLAT + LANES), np.inf)
    dy2 = np.full(LANES, np.inf)
    for k in range(points.shape[0]):
        cx, cy = int((points[k, 0] - left) / cell), int((points[k, 1] - bottom) / cell)
        for j in range(2 * SPLAT + 1):
            dy = bottom + (cy + j - SPLAT + 0.5) * cell - points[k, 1]
            dy2[j] = dy * dy
        for i in range(2 * SPLAT + 1):
            dx = left + (cx + i - SPLAT + 0.5) * cell - points[k, 0]
            row = squares[cx + i, cy : cy + LANES]
            for j in range(LANES):
                square = dx * dx + dy2[j]
                row[j] = square if square < row[j] else row[j]
    for ix in range(width):
        for iy in range(height):
            square = squares[ix + SPLAT, iy + SPLAT]
            if square < np.inf:
                finest[ix + TILE_SIDE, iy + TILE_SIDE] = np.exp(-0.5 * square / (spread * spread))


@kernel
def _levels(finest: NDArray[np.float32], unit: int) -> tuple[NDArray[np.int64], NDArray[np.uint16]]:
    """`quarters` and `coarsest` of a field."""
    width, height = finest.shape
    quarters = np.empty((LEVELS - 1, width, height), dtype=np.int64)
    # Cells behind the last ones are zero.
    finer = np.zeros((width + TILE_SIDE, height + TILE_SIDE), dtype=np.uint16)
    for ix in range(width):
        for iy in range(height):
            finer[ix, iy] = np.uint16(np.ceil(finest[ix, iy] * unit))
    for level in range(1, LEVELS + 1):
        half = 1 << (level - 1)
        # A row is written where it is not needed any more, since squares reach forward.
        for ix in range(width):
            here, there = finer[ix], finer[ix + half]
            if level > 1:
                packed = quarters[level - 2, ix]
                for iy in range(height):
                    low = np.int64(here[iy]) | (np.int64(there[iy]) << LANE_BITS)
                    high = np.int64(here[iy + half]) | (np.int64(there[iy + half]) << LANE_BITS)
                    packed[iy] = low | (high << 2 * LANE_BITS)
            for iy in range(height):
                greater, farther = max(here[iy], there[iy]), max(here[iy + half], there[iy + half])
                here[iy] = max(greater, farther)
    return quarters, finer[:width, :height].copy()
