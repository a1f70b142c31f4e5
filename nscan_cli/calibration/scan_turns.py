"""Rough turns of the robot from scan to scan, by the ranges alone: they show where a closer look is worth it.

If a laser turns by an angle, what it sees moves by that angle the other way. The shift is found in whole
cells of directions, and refined by a parabola. A metre driven meanwhile hardly matters: it changes the ranges
of most directions less than a turn does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices

CELLS = 120
"""Directions all around; a scan has one range for each."""
MOST = 20
"""Cells; a turn of more is not looked for: 60°."""
DIFFERS = 0.5
"""m; two ranges that differ by more see different things, however far apart these are."""
NOTHING = 1e3
"""m; the range of a direction without return, and of one that the laser does not look in."""


def scan_turns(log: LaserLog, first: Indices, last: Indices) -> Array:
    """(n,) about how far (rad) the laser turned from the scans in rows `first` (n,) to those in `last`."""
    before, after = _profiles(log, first), _profiles(log, last)
    around = np.concatenate([before[:, -MOST:], before, before[:, :MOST]], axis=1)
    costs = np.empty((len(first), 2 * MOST + 1))
    for shift in range(2 * MOST + 1):
        apart = np.abs(around[:, shift : shift + CELLS] - after)
        costs[:, shift] = np.minimum(apart, np.float32(DIFFERS)).sum(axis=1)
    return (_lowest(costs) - MOST) * (2 * np.pi / CELLS)


def _profiles(log: LaserLog, rows: Indices) -> NDArray[np.float32]:
    """(n, CELLS) the range (m) that the scan in each row has in each direction, from −π on."""
    step, beams = log.angle_increment[rows][:, None], log.beam_counts()[rows][:, None]
    directions = np.linspace(-np.pi, np.pi, CELLS, endpoint=False)
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
