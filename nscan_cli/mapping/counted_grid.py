"""An occupancy grid from hits and misses that stand in whole arrays, for what changes the cells of a map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.occupancy import DEFAULT_OCCUPANCY, OccupancyGrid, OccupancyOptions
from nscan_cli.mapping.ray_casting import TILE, TileCounts


def grid_of_counts(
    hits: NDArray[np.int32],
    misses: NDArray[np.int32],
    resolution: float,
    origin: tuple[float, float],
    options: OccupancyOptions = DEFAULT_OCCUPANCY,
) -> OccupancyGrid:
    """The grid with these hits and misses (H, W), the least y first."""
    height, width = hits.shape
    rows, columns = -(-height // TILE), -(-width // TILE)
    padded = np.zeros((2, rows * TILE, columns * TILE), dtype=np.int32)
    padded[:, :height, :width] = hits, misses
    counts = padded.reshape(2, rows, TILE, columns, TILE).transpose(1, 3, 0, 2, 4).reshape(-1, 2, TILE, TILE)
    used = counts.any(axis=(1, 2, 3))
    numbers = np.where(used, np.cumsum(used) - 1, -1).astype(np.int32).reshape(rows, columns)
    tiles = TileCounts(numbers, np.ascontiguousarray(counts[used]))
    return OccupancyGrid(tiles, (height, width), resolution, origin, options)
