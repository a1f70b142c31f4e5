"""Beams followed through the cells of a grid, and counted there.

J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", 1987.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.compiled import kernel
from nscan_cli.poses import Array

TILE = 32
"""Cells along the side of a tile."""


class Tiles(NamedTuple):
    """The counts of the parts of a grid that a beam has met; most of a large map none ever does."""

    numbers: NDArray[np.int32]
    """(⌈H / TILE⌉, ⌈W / TILE⌉) the number of each tile; −1 for one that no beam has met."""
    counts: NDArray[np.int32]
    """(T, 2, TILE, TILE) hits, then misses, of each tile that has a number; those of others are 0."""


class Scans(NamedTuple):
    """The scans of a log that are cast, and where from."""

    rows: NDArray[np.int64]
    """(N,) of the log."""
    ranges: NDArray[np.float32]
    """(S, B) m"""
    angle_min: Array
    """(S,) rad"""
    angle_increment: Array
    """(S,) rad"""
    lasers: Array
    """(N, 3) poses of the laser."""


def counted(
    scans: Scans, reach: float, shape: tuple[int, int], resolution: float, left: int, bottom: int
) -> Tiles:
    """How the beams of all scans, up to `reach` (m), meet the cells of a grid of `shape` (H, W).

    Its cell (0, 0) has its lower left corner at (left, bottom) · resolution; no beam may leave it.
    """
    index = np.full((-(-shape[0] // TILE), -(-shape[1] // TILE)), -1, dtype=np.int32)
    # There is room for all tiles, but only those that are written to take any memory: the first ones.
    counts = np.zeros((index.size, 2, TILE, TILE), dtype=np.int32)
    _cast(scans, reach, resolution, left, bottom, Tiles(index, counts))
    return Tiles(index, counts)


@kernel
def extent(scans: Scans, reach: float) -> tuple[float, float, float, float]:
    """The least x and y and the greatest x and y of the lasers and of their beams' ends."""
    rows, ranges, angle_min, angle_increment, lasers = scans
    low_x = high_x = lasers[0, 0]
    low_y = high_y = lasers[0, 1]
    for k in range(len(rows)):
        row = rows[k]
        x, y, heading = lasers[k]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        for beam in range(ranges.shape[1]):
            if not np.isfinite(ranges[row, beam]):
                continue
            r = min(float(ranges[row, beam]), reach)
            # Most beams are so short that they end within, whatever their direction is.
            if x - r > low_x and x + r < high_x and y - r > low_y and y + r < high_y:
                continue
            angle = heading + angle_min[row] + beam * angle_increment[row]
            end_x, end_y = x + r * np.cos(angle), y + r * np.sin(angle)
            low_x, high_x = min(low_x, end_x), max(high_x, end_x)
            low_y, high_y = min(low_y, end_y), max(high_y, end_y)
    return low_x, low_y, high_x, high_y


@kernel
def _cast(scans: Scans, reach: float, resolution: float, left: int, bottom: int, tiles: Tiles) -> None:
    """Add the beams of all scans to the counts of the tiles."""
    rows, ranges, angle_min, angle_increment, lasers = scans
    used = 0
    for k in range(len(rows)):
        row = rows[k]
        x = lasers[k, 0] / resolution - left
        y = lasers[k, 1] / resolution - bottom
        for beam in range(ranges.shape[1]):
            r = float(ranges[row, beam])
            if not np.isfinite(r):
                continue
            angle = lasers[k, 2] + angle_min[row] + beam * angle_increment[row]
            length = min(r, reach) / resolution
            end_x, end_y = x + length * np.cos(angle), y + length * np.sin(angle)
            used = _pass(x, y, end_x, end_y, tiles, used)
            if r <= reach:
                line, column = int(end_y), int(end_x)
                used = _met(tiles.numbers, line // TILE, column // TILE, used)
                tile = tiles.numbers[line // TILE, column // TILE]
                tiles.counts[tile, 0, line % TILE, column % TILE] += 1


@kernel
def _met(numbers: NDArray[np.int32], row: int, column: int, used: int) -> int:
    """Give a tile its number if it has none; returns how many have one."""
    if numbers[row, column] < 0:
        numbers[row, column] = used
        return used + 1
    return used


@kernel
def _pass(x: float, y: float, end_x: float, end_y: float, tiles: Tiles, used: int) -> int:
    """Count the cells from (x, y) up to, and without, the cell of the end as missed; in cells.

    Returns how many tiles are used.

    `t` grows from 0 to 1 along the ray; a ray through a corner takes the step in y first.
    """
    column, line = int(x), int(y)
    dx, dy = end_x - x, end_y - y
    steps_x, steps_y = abs(int(end_x) - column), abs(int(end_y) - line)
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    between_x = 1 / abs(dx) if steps_x > 0 else np.inf
    between_y = 1 / abs(dy) if steps_y > 0 else np.inf
    next_x = ((column + 1 - x) if dx > 0 else (x - column)) * between_x if steps_x > 0 else np.inf
    next_y = ((line + 1 - y) if dy > 0 else (y - line)) * between_y if steps_y > 0 else np.inf
    tile, tile_row, tile_column = -1, -1, -1
    while steps_x + steps_y > 0:
        if line // TILE != tile_row or column // TILE != tile_column:
            tile_row, tile_column = line // TILE, column // TILE
            used = _met(tiles.numbers, tile_row, tile_column, used)
            tile = tiles.numbers[tile_row, tile_column]
        tiles.counts[tile, 1, line % TILE, column % TILE] += 1
        # The counts of steps decide at the end, so that rounding never leads past the cell of the end.
        if steps_y == 0 or (steps_x > 0 and next_x < next_y):
            column += step_x
            next_x += between_x
            steps_x -= 1
        else:
            line += step_y
            next_y += between_y
            steps_y -= 1
    return used
