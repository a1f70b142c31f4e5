"""Rough turns of the robot from scan to scan, by the ranges alone: they show where a closer look is worth it.

If a laser turns by an angle, what it sees moves by that angle the other way. The shift is found in whole
cells of directions, and refined by a parabola. A metre driven meanwhile hardly matters: it changes the ranges
of most directions less than a turn does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.calibration.sweep_options import ScanTurnOptions
from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices

PARTS = 8
"""Parts in which sums of single precision are added up, so that less is lost by rounding."""
NOTHING = 1e3
"""m; the range of a direction without return, and of one that the laser does not look in."""


def scan_turns(log: LaserLog, first: Indices, last: Indices, options: ScanTurnOptions) -> Array:
    """(n,) about how far (rad) the laser turned from the scans in rows `first` (n,) to those in `last`."""
    cells, most = options.cells, options.most_cells
    before, after = _profiles(log, first, cells), _profiles(log, last, cells)
    around = np.concatenate([before[:, -most:], before, before[:, :most]], axis=1)
    costs = _costs(around, after, np.float32(options.max_difference))
    return (_lowest(costs) - most) * (2 * np.pi / cells)


def _profiles(log: LaserLog, rows: Indices, cells: int) -> NDArray[np.float32]:
    """(n, cells) the range (m) that the scan in each row has in each direction, from −π on."""
    first, step = log.angle_min[rows, None], log.angle_increment[rows, None]
    if (first == first[:1]).all() and (step == step[:1]).all():
        # Nearly all scans of a log have the same directions.
        first, step = first[:1], step[:1]
    directions = np.linspace(-np.pi, np.pi, cells, endpoint=False)
    ahead = np.mod((directions - first) * np.sign(step), 2 * np.pi)
    beam = np.rint(ahead / np.abs(step)).astype(np.int64)
    # All around, the direction before the first beam is that of the last, or of the first.
    beam[beam == np.rint(2 * np.pi / np.abs(step)).astype(np.int64)] = 0
    ranges = log.ranges[rows[:, None], np.minimum(beam, log.ranges.shape[1] - 1)]
    seen = (beam < log.beam_counts()[rows, None]) & np.isfinite(ranges)
    return np.where(seen, ranges, np.float32(NOTHING))


@kernel
def _costs(around: NDArray[np.float32], after: NDArray[np.float32], most: np.float32) -> Array:
    """(n, M) the difference of profiles (n, cells) to those before, with M − 1 more cells, from each of these
    cells on. A range that differs by more than `most` (m) differs by that.
    """
    cells = after.shape[1]
    count = around.shape[1] - cells + 1
    costs, sums = np.empty((len(after), count)), np.empty((PARTS, count), dtype=np.float32)
    for row in range(len(after)):
        sums[:] = 0.0
        for cell in range(cells):
            part, value = sums[cell % PARTS], after[row, cell]
            for shift in range(count):
                part[shift] += min(abs(around[row, cell + shift] - value), most)
        for shift in range(count):
            s = sums[:, shift]
            costs[row, shift] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]))
    return costs


def _lowest(costs: Array) -> Array:
    """(n,) places of the lowest of costs (n, m), by a parabola through it and those beside it."""
    rows, best = np.arange(len(costs)), np.clip(np.argmin(costs, axis=1), 1, costs.shape[1] - 2)
    left, middle, right = costs[rows, best - 1], costs[rows, best], costs[rows, best + 1]
    bend = left - 2.0 * middle + right
    found: Array = best + 0.5 * (left - right) / np.where(bend > 0.0, bend, np.inf)
    return found
