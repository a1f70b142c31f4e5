"""Poses + scans → how often each cell of the floor was hit by a beam and how often passed through.

Rays are followed cell by cell (J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray
tracing", 1987). A cell's share of hits estimates how likely it reflects a beam (the counting model of
S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, 9.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.compiled import kernel
from nscan_cli.errors import WrongUsageError
from nscan_cli.limits import MAP_CELLS
from nscan_cli.logs.scan import LaserLog
from nscan_cli.poses import Array

RESOLUTION = 0.05
"""Size of a cell, m."""
REACH = 40.0
"""A beam is followed so far (m): further out, neighbouring beams leave gaps of many cells, and a slip of
the angle carries a wall away."""
COARSEST = 10.0
"""m; a map of larger cells shows nothing."""
OCCUPIED_SHARE = 0.25
"""A cell is occupied when at least this share of the beams that reached it ended in it. Under one half,
since beams that run along a wall graze its cells on their way to the next ones, and a wall on the border
of two cells shares its hits among them; well above the share that somebody leaves who walks by."""
LEAST_HITS = 2
"""A cell that a single beam has hit is not taken for occupied: that is what stray returns look like."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""The states of a cell, with the values of ROS's OccupancyGrid message."""


@dataclass(frozen=True)
class OccupancyGrid:
    """Counts of a grid of H × W cells; row 0 is the row of least y, column 0 that of least x."""

    hits: NDArray[np.int32]
    """(H, W) how many beams end in the cell."""
    misses: NDArray[np.int32]
    """(H, W) how many beams pass through the cell or start in it, and end in another."""
    resolution: float
    """Size of a cell, m."""
    origin: tuple[float, float]
    """x, y (m) of the lower left corner of the cell (0, 0)."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The least x, least y, greatest x and greatest y (m) that the grid covers."""
        (height, width), (x, y) = self.hits.shape, self.origin
        return x, y, x + width * self.resolution, y + height * self.resolution

    def states(self) -> NDArray[np.int8]:
        """(H, W) FREE, OCCUPIED or UNKNOWN.

        A cell that was passed through but not hit often enough to be occupied is free; one that was only
        hit, by a single beam, stays unknown.
        """
        states = np.full(self.hits.shape, UNKNOWN, dtype=np.int8)
        states[self.misses > 0] = FREE
        hit = np.flatnonzero(self.hits.ravel() >= LEAST_HITS)
        hits, misses = self.hits.ravel()[hit], self.misses.ravel()[hit]
        states.ravel()[hit[hits >= OCCUPIED_SHARE * (hits + misses)]] = OCCUPIED
        return states


def occupancy_grid(
    log: LaserLog, rows: NDArray[np.int64], poses: Array, resolution: float = RESOLUTION
) -> OccupancyGrid:
    """The grid of the scans in `rows` (N,) of the log, taken at the robot's `poses` (N, 3).

    A beam that met nothing clears nothing: it may as well have met black velvet, or glass. A beam longer
    than REACH clears the cells up to there. The grid covers all beams and poses, and its cells lie on
    multiples of the resolution. Raises WrongUsageError when there are no scans, or when the grid would
    have more cells than the limit MAP_CELLS allows.
    """
    if len(rows) == 0:
        raise WrongUsageError(f"{log.source.name}: no scans to draw a map of; choose some")
    lasers = np.ascontiguousarray(log.laser_pose(poses))
    scans = (np.asarray(rows, dtype=np.int64), log.ranges, log.angle_min, log.angle_increment, lasers)
    low_x, low_y, high_x, high_y = _extent(*scans, REACH)
    # One cell to spare: the border of the map is then free of what is drawn in it, and rounding harmless.
    left, bottom = math.floor(low_x / resolution) - 1, math.floor(low_y / resolution) - 1
    width = math.floor(high_x / resolution) + 2 - left
    height = math.floor(high_y / resolution) + 2 - bottom
    most = MAP_CELLS.value
    if width * height > most:
        enough = _rounded_up(resolution * math.sqrt(width * height / most))
        remedy = "some poses are far off" if enough > COARSEST else f"choose --resolution {enough:g}"
        raise WrongUsageError(
            f"a map of {high_x - low_x:.0f} m × {high_y - low_y:.0f} m would have {width * height:,} cells "
            f"of {resolution:g} m, more than {most:,.0f}; {remedy}, or set {MAP_CELLS.variable} higher"
        )
    hits, misses = np.zeros((height, width), dtype=np.int32), np.zeros((height, width), dtype=np.int32)
    _cast(*scans, REACH, resolution, left, bottom, hits, misses)
    return OccupancyGrid(hits, misses, resolution, (left * resolution, bottom * resolution))


def _rounded_up(value: float) -> float:
    """To two significant digits, never less than `value`."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.ceil(value / unit) * unit, 12)


@kernel
def _extent(
    rows: NDArray[np.int64],
    ranges: NDArray[np.float32],
    angle_min: Array,
    angle_increment: Array,
    lasers: Array,
    reach: float,
) -> tuple[float, float, float, float]:
    """The least x and y and the greatest x and y of the lasers (N, 3) and of their beams' ends."""
    low_x = high_x = lasers[0, 0]
    low_y = high_y = lasers[0, 1]
    for k in range(len(rows)):
        row = rows[k]
        x, y, heading = lasers[k]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        for beam in range(ranges.shape[1]):
            r = float(ranges[row, beam])
            if not np.isfinite(r):
                continue
            angle = heading + angle_min[row] + beam * angle_increment[row]
            end_x = x + min(r, reach) * np.cos(angle)
            end_y = y + min(r, reach) * np.sin(angle)
            low_x, high_x = min(low_x, end_x), max(high_x, end_x)
            low_y, high_y = min(low_y, end_y), max(high_y, end_y)
    return low_x, low_y, high_x, high_y


@kernel
def _cast(
    rows: NDArray[np.int64],
    ranges: NDArray[np.float32],
    angle_min: Array,
    angle_increment: Array,
    lasers: Array,
    reach: float,
    resolution: float,
    left: int,
    bottom: int,
    hits: NDArray[np.int32],
    misses: NDArray[np.int32],
) -> None:
    """Add the beams of all scans to `hits` and `misses` (H, W).

    Cell (0, 0) of the arrays has its lower left corner at (left, bottom) · resolution.
    """
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
            _pass(x, y, end_x, end_y, misses)
            if r <= reach:
                hits[int(end_y), int(end_x)] += 1


@kernel
def _pass(x: float, y: float, end_x: float, end_y: float, misses: NDArray[np.int32]) -> None:
    """Count the cells from (x, y) up to, and without, the cell of the end as missed; in cells.

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
    while steps_x + steps_y > 0:
        misses[line, column] += 1
        # The counts of steps decide at the end, so that rounding never leads past the cell of the end.
        if steps_y == 0 or (steps_x > 0 and next_x < next_y):
            column += step_x
            next_x += between_x
            steps_x -= 1
        else:
            line += step_y
            next_y += between_y
            steps_y -= 1
