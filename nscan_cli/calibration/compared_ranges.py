"""The ranges of each scan, compared with those that the scan before predicts by odometry.

Of one comparison it is told whether all ranges changed by one factor, and whether the readings come in the
other order from a scan on.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.range_jump_options import RangeJumpOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.predicted_ranges import beams_along, predicted_ranges
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
        as_read, mirrored = _ratios(log, rows, jumps)
        found.mirror_gains[rows] = _agreeing(mirrored, options) - _agreeing(as_read, options)
        # Those that are nan come last.
        values = np.sort(as_read, axis=1)
        count = len(values[0]) - np.count_nonzero(np.isnan(values), axis=1)
        some = np.flatnonzero(count >= jumps.min_beams)
        values, count = values[some], count[some]
        each = np.arange(len(some))
        usual = 0.5 * (np.log(values[each, (count - 1) // 2]) + np.log(values[each, count // 2]))
        near = _are_within(values * np.exp(-usual)[:, None], jumps.tolerance)
        found.logarithms[rows[some]], found.shares[rows[some]] = usual, near / count
    return found


def _agreeing(ratios: Array, options: FileCheckOptions) -> Array:
    """(n,) the share of ratios (n, B) that are nearly 1, of those that are known."""
    count = len(ratios[0]) - np.count_nonzero(np.isnan(ratios), axis=1)
    share: Array = _are_within(ratios, options.order.tolerance) / np.maximum(count, options.jumps.min_beams)
    return share


def _are_within(ratios: Array, tolerance: float) -> Indices:
    """(n,) how many of ratios (n, B) have a logarithm that is smaller than this."""
    are_within = (ratios > math.exp(-tolerance)) & (ratios < math.exp(tolerance))
    count: Indices = np.count_nonzero(are_within, axis=1)
    return count


def _ratios(log: LaserLog, first: Indices, options: RangeJumpOptions) -> tuple[Array, Array]:
    """(n, B) the ranges of the scans behind successive rows (n,), divided by those that these scans predict;
    nan where there is none. The second are those as if the later scans were mirror images."""
    last, width = first + 1, log.ranges.shape[1]
    beams = np.arange(0, width, max(width // options.max_beams, 1))
    steps = laser_steps(log, first, last)
    lengths = log.ranges[first[0] : last[-1], beams].astype(np.float64)
    np.copyto(lengths, np.nan, where=~np.isfinite(lengths))
    begin, between = log.angle_min[first, None], log.angle_increment[first, None]
    if (begin == begin[0]).all() and (between == between[0]).all():
        # Nearly all scans of a log have the same directions.
        begin, between = begin[:1], between[:1]
    angles = begin + beams * between
    predicted, directions = predicted_ranges(lengths, angles, steps)
    predicted[predicted == 0.0] = np.nan
    as_read, mirrored = (_ranges_along(log, last, each) / predicted for each in (directions, -directions))
    return as_read, mirrored


def _ranges_along(log: LaserLog, rows: Indices, directions: Array) -> Array:
    """(n, B) the ranges of scans in rows (n,) along directions (n, B), rad; nan for none."""
    beams, has = beams_along(
        directions, log.angle_min[rows, None], log.angle_increment[rows, None], log.ranges.shape[1]
    )
    found = log.ranges[rows[:, None], beams].astype(np.float64)
    found[~(has & np.isfinite(found))] = np.nan
    return found


def laser_steps(log: LaserLog, first: Indices, last: Indices) -> Array:
    """(n, 3) the steps of the laser between rows by odometry; none where there is no odometry."""
    if log.odometry is None:
        return np.zeros((len(first), 3))
    robot = relative(log.odometry[last], log.odometry[first])
    return np.nan_to_num(relative(compose(robot, log.mount), log.mount))
