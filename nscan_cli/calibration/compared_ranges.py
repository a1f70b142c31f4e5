"""The ranges of each scan, compared with those that the scan before predicts by odometry.

Of one comparison it is told whether all ranges changed by one factor, and whether the readings come in the
other order from a scan on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.range_jump_options import RangeJumpOptions
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices, compose, relative

COMPARED_AT_ONCE = 512
"""Scans that are compared at a time: what is worked out for so many stays in the cache of a processor."""


class ComparedRanges(NamedTuple):
    """What the ranges of each scan but the first are to what the scan before predicts."""

    logarithms: Array
    """(S − 1,) logarithm of the usual factor between both; nan for few beams."""
    shares: Array
    """(S − 1,) share of the beams that have that factor; 0 for few."""
    mirror_gains: Array
    """(S − 1,) by how much more of the beams agree if the later scan is read in the other order, as a share
    of all that are compared."""


def compare_ranges(log: LaserLog, options: FileCheckOptions) -> ComparedRanges:
    """Compare each scan of a log with the one before."""
    size, jumps = max(len(log) - 1, 0), options.jumps
    found = ComparedRanges(np.full(size, np.nan), np.zeros(size), np.zeros(size))
    for begin in range(0, size, COMPARED_AT_ONCE):
        rows = np.arange(begin, min(begin + COMPARED_AT_ONCE, size))
        as_read, mirrored = _factors(log, rows, jumps)
        gains = _agreeing(mirrored, options) - _agreeing(as_read, options)
        found.mirror_gains[rows] = gains
        # Those that are nan come last.
        values = np.sort(as_read, axis=1)
        count = np.isfinite(values).sum(axis=1)
        some = np.flatnonzero(count >= jumps.min_beams)
        values, count = values[some], count[some]
        each = np.arange(len(some))
        usual = 0.5 * (values[each, (count - 1) // 2] + values[each, count // 2])
        near = np.abs(values - usual[:, None]) < jumps.tolerance
        found.logarithms[rows[some]], found.shares[rows[some]] = usual, near.sum(axis=1) / count
    return found


def _agreeing(values: Array, options: FileCheckOptions) -> Array:
    """(n,) the share of logarithms (n, B) that are nearly 0, of those that are known."""
    count = np.maximum(np.isfinite(values).sum(axis=1), options.jumps.min_beams)
    share: Array = (np.abs(values) < options.order.tolerance).sum(axis=1) / count
    return share


def _factors(log: LaserLog, first: Indices, options: RangeJumpOptions) -> tuple[Array, Array]:
    """(n, B) the logarithms of the ranges of the scans behind successive rows (n,), divided by those that
    these scans predict; nan where there is none. The second are those as if the later scans were mirror
    images."""
    every = max(log.ranges.shape[1] // options.max_beams, 1)
    found = np.full((2, len(first), -(-log.ranges.shape[1] // every)), np.nan)
    steps = laser_steps(log, first, first + 1)
    _write_factors(log.ranges, log.angle_min, log.angle_increment, int(first[0]), steps, every, found)
    return found[0], found[1]


@kernel
def _write_factors(
    ranges: NDArray[np.float32],
    angle_min: Array,
    angle_increment: Array,
    begin: int,
    steps: Array,
    every: int,
    found: Array,
) -> None:
    """Write what `_factors` gives (2, n, B), of successive scans from row `begin` on, between which the laser
    makes steps (n, 3)."""
    directions, start, between = np.empty((ranges.shape[1], 2)), np.nan, np.nan
    for k in range(len(steps)):
        i, x0, y0, turn = begin + k, steps[k, 0], steps[k, 1], steps[k, 2]
        if angle_min[i] != start or angle_increment[i] != between:
            start, between = angle_min[i], angle_increment[i]
            write_directions(directions, start, between, every)
        around, per_beam = beams_around(angle_increment[i + 1]), 1.0 / angle_increment[i + 1]
        for beam in range(0, ranges.shape[1], every):
            if not np.isfinite(ranges[i, beam]):
                continue
            length = np.float64(ranges[i, beam])
            x, y = length * directions[beam, 0] - x0, length * directions[beam, 1] - y0
            direction, predicted = np.arctan2(y, x) - turn, np.sqrt(x * x + y * y)
            for side in range(2):
                towards = direction if side == 0 else -direction
                seen = beam_at((towards - angle_min[i + 1]) * per_beam, around)
                if seen < ranges.shape[1] and np.isfinite(ranges[i + 1, seen]):
                    found[side, k, beam // every] = np.log(ranges[i + 1, seen] / predicted)


@leaf_kernel
def write_directions(out: Array, begin: float, between: float, every: int) -> None:
    """Write the cosine and the sine (B, 2) of one in `every` of the directions of a scan."""
    for beam in range(0, len(out), every):
        out[beam, 0], out[beam, 1] = np.cos(begin + beam * between), np.sin(begin + beam * between)


@leaf_kernel
def beams_around(between: float) -> int:
    """How many beams that are `between` (rad) apart go all around."""
    return max(round(2 * np.pi / abs(between)), 1)


@leaf_kernel
def beam_at(place: float, around: int) -> int:
    """The number of the beam nearest to a place among those of a scan, of which `around` go all around."""
    beam = int(np.floor(place + 0.5))
    # A division takes as long as all else.
    return beam if 0 <= beam < around else beam % around


def laser_steps(log: LaserLog, first: Indices, last: Indices) -> Array:
    """(n, 3) the steps of the laser between rows by odometry; none where there is no odometry."""
    if log.odometry is None:
        return np.zeros((len(first), 3))
    robot = relative(log.odometry[last], log.odometry[first])
    return np.nan_to_num(relative(compose(robot, log.mount), log.mount))
