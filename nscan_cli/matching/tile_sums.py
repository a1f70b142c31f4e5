"""Upper bounds of a scan's scores in all squares of a window at once: the first step of branch and bound.

A window of 100 m to each side with all directions has two million squares. Of a hundred this step leaves one
to be looked at more closely.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.likelihood_field import TILE_SIDE


class TileSums(NamedTuple):
    """Tiles are squares of TILE_SIDE × TILE_SIDE shifts of a scan, of which each is a cell."""

    sums: NDArray[np.uint16]
    """(a, t, u) with each of the angles (a,), the greatest sums of the field's values at the points' cells
    that a shift in the tile may have, in the field's `unit`."""
    first: tuple[int, int]
    """The first shift of the first tile, cells."""


def tile_sums(coarsest: NDArray[np.uint16], cells: NDArray[np.int32], reach: int) -> TileSums:
    """The sums of the tiles in a window of `reach` cells to each side, but for those where no point meets the
    field.

    `coarsest` (w, h) is that of a field, `cells` (a, 2, m) are those of the points without any shift.
    """
    first, counts = [], []
    for size, axis in zip(coarsest.shape, np.moveaxis(cells, 1, 0), strict=True):
        nearest, farthest = (int(each) for each in (axis.min(), axis.max()))
        begin = max((-reach + TILE_SIDE + farthest) // -TILE_SIDE, 0)
        end = min((size - 1 + reach - nearest) // TILE_SIDE, 2 * reach // TILE_SIDE) + 1
        first.append(begin * TILE_SIDE - reach)
        counts.append(max(end - begin, 0))
    return TileSums(_sums(coarsest, cells, first[0], first[1], counts[0], counts[1]), (first[0], first[1]))


@kernel
def _sums(
    coarsest: NDArray[np.uint16], cells: NDArray[np.int32], x: int, y: int, columns: int, rows: int
) -> NDArray[np.uint16]:
    """(a, columns, rows) the sums of the tiles from the shift (x, y) on.

    For each place of a cell in a square there is a plane, where the squares from that cell on are neighbours.
    Behind each column it has as many zeros as there are tiles in one. So the numbers to add for one point
    lie in one row, and where tiles leave the field they are zero.
    """
    width, height = coarsest.shape
    wide, high = (width - 1) // TILE_SIDE + 1, (height - 1) // TILE_SIDE + 1
    stride = high + rows
    planes = np.zeros((TILE_SIDE, TILE_SIDE, wide * stride), dtype=np.uint16)
    for ix in range(width):
        for iy in range(height):
            planes[ix % TILE_SIDE, iy % TILE_SIDE, ix // TILE_SIDE * stride + iy // TILE_SIDE] = coarsest[
                ix, iy
            ]
    sums = np.empty((cells.shape[0], columns, rows), dtype=np.uint16)
    total = np.empty(columns * stride, dtype=np.uint16)
    for a in range(cells.shape[0]):
        total[:] = 0
        for k in range(cells.shape[2]):
            ix, iy = cells[a, 0, k] + x, cells[a, 1, k] + y
            left, low = ix // TILE_SIDE, iy // TILE_SIDE
            begin, end = max(-left, 0), min(wide - left, columns)
            if begin >= end or low <= -rows or low >= high:
                continue
            start, stop = begin * stride + max(-low, 0), (end - 1) * stride + min(rows, high - low)
            shift = left * stride + low
            row, into = (
                planes[ix % TILE_SIDE, iy % TILE_SIDE, start + shift : stop + shift],
                total[start:stop],
            )
            for j in range(stop - start):
                into[j] += row[j]
        for i in range(columns):
            sums[a, i] = total[i * stride : i * stride + rows]
    return sums
