"""The turn that lays most walls of a map along its axes.

Where walls lie along an axis, their cells fall on few lines of the grid: the sum of the squared counts of
the projections on both axes is greatest there. Walls that stand at right angles count together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.mapping.occupancy import OCCUPIED, OccupancyGrid
from nscan_cli.poses import Array


@dataclass(frozen=True)
class WallAlignmentOptions:
    """Decide how finely the turn is searched."""

    coarse_step: float = math.radians(0.25)
    """Step of the first search through 90°, rad. With a larger one long walls can be missed."""
    coarse_width: float = 0.1
    """Standard deviation of the lines in the first search, m. A larger value tells directions less; a smaller
    one does not hold walls whose ends a step displaces by more."""
    fine_step: float = math.radians(0.01)
    """Step of the search around the best turn, rad: 1.7 cm at the end of a wall of 100 m. A larger value
    turns less exactly."""
    fine_width: float = 0.05
    """Standard deviation of the lines in the search around the best turn, m. A larger value tells directions
    less. With less than a cell, the raster of the map attracts its walls."""
    bins: int = 2
    """Number of bins of the projections in a standard deviation of the lines. A larger number is more exact,
    and takes longer."""
    bell_bins: int = 6
    """Lines reach so many bins to both sides. A larger number is more exact, and takes longer."""


def wall_alignment(grid: OccupancyGrid, options: WallAlignmentOptions = WallAlignmentOptions()) -> float:
    """The turn about the map's origin, rad, from −45° to 45°; 0 for a map without occupied cells."""
    lines, columns = np.nonzero(grid.states() == OCCUPIED)
    if len(lines) == 0:
        return 0.0
    points: Array = ((np.column_stack([columns, lines]) + 0.5) * grid.resolution).astype(np.float64)
    points -= points.mean(axis=0)
    steps = math.floor(math.pi / 4 / options.coarse_step)
    coarse: Array = options.coarse_step * np.arange(-steps, steps + 1, dtype=np.float64)
    best = _best_turn(points, coarse, max(options.coarse_width, grid.resolution), options)
    around = math.ceil(options.coarse_step / options.fine_step)
    fine: Array = best + options.fine_step * np.arange(-around, around + 1, dtype=np.float64)
    turn = _best_turn(points, fine, max(options.fine_width, grid.resolution), options)
    return turn - math.pi / 2 * round(turn / (math.pi / 2))


def _best_turn(points: Array, turns: Array, width: float, options: WallAlignmentOptions) -> float:
    """The turn after which the points (N, 2) gather most on lines of this width along the axes.

    Of equal ones it is the smallest.
    """
    reach = float(np.hypot(*points.T).max())
    bin_size, places = width / options.bins, np.arange(-options.bell_bins, options.bell_bins + 1)
    bell = np.exp(-0.5 * (places / options.bins) ** 2)
    count = math.ceil(2 * reach / bin_size) + 2

    def gathering(turn: float) -> float:
        c, s = math.cos(turn), math.sin(turn)
        found = 0.0
        for part in (c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]):
            # A point belongs to the two bins beside it by its distance from each.
            place = (part + reach) / bin_size
            lower = place.astype(np.int64)
            share = place - lower
            counts = np.bincount(lower, 1 - share, count) + np.bincount(lower + 1, share, count)
            found += float((np.convolve(counts, bell) ** 2).sum())
        return found

    return float(min(turns.tolist(), key=lambda turn: (-gathering(turn), abs(turn))))
