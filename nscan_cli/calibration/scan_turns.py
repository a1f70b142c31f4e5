"""Rough turns of the robot from scan to scan, by the ranges alone: they show where a closer look is worth it.

If a laser turns by an angle, what it sees moves by that angle the other way. The shift is found in whole
cells of directions, and refined by a parabola. A metre driven meanwhile hardly matters: it changes the ranges
of most directions less than a turn does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.calibration.sweep_options import ScanTurnOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices

NOTHING = 1e3
"""m; the range of a direction without return, and of one that the laser does not look in."""


def scan_turns(log: LaserLog, first: Indices, last: Indices, options: ScanTurnOptions) -> Array:
    """(n,) about how far (rad) the laser turned from the scans in rows `first` (n,) to those in `last`."""
    cells, most = options.cells, options.most_cells
    before, after = _profiles(log, first, cells), _profiles(log, last, cells)
    around = np.concatenate([before[:, -most:], before, before[:, :most]], axis=1)
    costs = np.empty((len(first), 2 * most + 1))
    for shift in range(2 * most + 1):
        apart = np.abs(around[:, shift : shift + cells] - after)
        costs[:, shift] = np.minimum(apart, np.float32(options.max_difference)).sum(axis=1)
    return (_lowest(costs) - most) * (2 * np.pi / cells)


def _profiles(log: LaserLog, rows: Indices, cells: int) -> NDArray[np.float32]:
    """(n, cells) the range (m) that the scan in each row has in each direction, from −π on."""
    step, beams = log.angle_increment[rows][:, None], log.beam_counts()[rows][:, None]
    directions = np.linspace(-np.pi, np.pi, cells, endpoint=False)
    ahead = np.mod((directions - log.angle_min[rows][:, None]) * np.sign(step), 2 * np.pi)
    beam = np.rint(ahead / np.abs(step)).astype(np.int64)
    # All around, the direction before the first beam is that of the last, or of the first.
    beam[beam == np.rint(2 * np.pi / np.abs(step)).astype(np.int64)] = 0
    ranges = log.ranges[rows[:, None], np.minimum(beam, log.ranges.shape[1] - 1)]
    seen = (beam < beams) & np.isfinite(ranges)
    return np.where(seen, ranges, np.float32(NOTHING))


def _lowest(costs: Array) -> Array:
    """(n,) places of the lowest of costs (n, m), by a parabola through it and those beside it."""
    rows, best = np.arange(len(costs)), np.clip(np.argmin(costs, axis=1), 1, costs.shape[1] - 2)
    left, middle, right = costs[rows, best - 1], costs[rows, best], costs[rows, best + 1]
    bend = left - 2.0 * middle + right
    found: Array = best + 0.5 * (left - right) / np.where(bend > 0.0, bend, np.inf)
    return found
