"""Occupancy grids with given hits and misses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.occupancy import OccupancyGrid
from nscan_cli.mapping.ray_casting import TILE, TileCounts


def grid_of_counts(
    hits: NDArray[np.int32], misses: NDArray[np.int32], resolution: float, origin: tuple[float, float]
) -> OccupancyGrid:
    """The grid with these hits and misses (H, W)."""
    height, width = hits.shape
    rows, columns = -(-height // TILE), -(-width // TILE)
    padded = np.zeros((2, rows * TILE, columns * TILE), dtype=np.int32)
    padded[:, :height, :width] = hits, misses
    counts = padded.reshape(2, rows, TILE, columns, TILE).transpose(1, 3, 0, 2, 4).reshape(-1, 2, TILE, TILE)
    numbers = np.arange(len(counts), dtype=np.int32).reshape(rows, columns)
    tiles = TileCounts(numbers, np.ascontiguousarray(counts))
    return OccupancyGrid(tiles, (height, width), resolution, origin)
