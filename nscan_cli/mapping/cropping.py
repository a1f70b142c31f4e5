"""Parts of a map: a rectangle that a user names, or the one around what was mapped without stray rays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import WrongUsageError
from nscan_cli.mapping.occupancy import OCCUPIED, OccupancyGrid, grid_of_counts
from nscan_cli.poses import Array

Box = tuple[float, float, float, float]
"""The least x, least y, greatest x and greatest y, m."""


@dataclass(frozen=True)
class CroppingOptions:
    """Decide what an automatic rectangle leaves out."""

    outside: float = 0.001
    """Share of the hits that may lie outside on each side. A larger value cuts off real walls; a smaller one
    keeps what was seen through a window far away."""
    margin: float = 0.5
    """Space around the rest, m. A larger value makes larger maps."""


def automatic_box(grid: OccupancyGrid, path: Array, options: CroppingOptions = CroppingOptions()) -> Box:
    """The box around nearly all hits of occupied cells, and around the path (N, 2)."""
    hits = np.where(grid.states() == OCCUPIED, grid.hits, 0).astype(np.int64)
    (low_x, high_x), (low_y, high_y) = (
        _span(hits.sum(axis=axis), start, grid.resolution, options.outside)
        for axis, start in ((0, grid.origin[0]), (1, grid.origin[1]))
    )
    (least_x, least_y), (most_x, most_y) = path.min(axis=0), path.max(axis=0)
    margin = options.margin
    return (
        min(low_x, float(least_x)) - margin,
        min(low_y, float(least_y)) - margin,
        max(high_x, float(most_x)) + margin,
        max(high_y, float(most_y)) + margin,
    )


def _span(counts: np.ndarray, start: float, size: float, outside: float) -> tuple[float, float]:
    """The interval (m) of lines of cells without the share `outside` of their counts at each end."""
    total = int(counts.sum())
    if total == 0:
        return math.inf, -math.inf
    below = np.cumsum(counts)
    first = int(np.searchsorted(below, outside * total, side="right"))
    last = int(np.searchsorted(below, (1 - outside) * total, side="left"))
    return start + first * size, start + (last + 1) * size


def cropped_grid(grid: OccupancyGrid, box: Box) -> OccupancyGrid:
    """The cells of a grid that the box meets. Raises WrongUsageError if it meets none."""
    (height, width), (x, y), size = grid.shape, grid.origin, grid.resolution
    # A border that lies on a cell's own is not to take the next cell along.
    left, bottom = (
        max(0, math.floor((low - start) / size + 1e-6)) for low, start in zip(box[:2], (x, y), strict=True)
    )
    right, top = (
        min(most, math.ceil((high - start) / size - 1e-6))
        for high, start, most in zip(box[2:], (x, y), (width, height), strict=True)
    )
    if left >= right or bottom >= top:
        low_x, low_y, high_x, high_y = grid.bounds
        raise WrongUsageError(
            f"--crop: leaves nothing of the map, which is from ({low_x:.1f}, {low_y:.1f}) m "
            f"to ({high_x:.1f}, {high_y:.1f}) m"
        )
    part = slice(bottom, top), slice(left, right)
    corner = (round(x / size + left) * size, round(y / size + bottom) * size)
    return grid_of_counts(grid.hits[part], grid.misses[part], size, corner, grid.options)
