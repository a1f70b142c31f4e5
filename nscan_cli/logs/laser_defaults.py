"""Defaults for what a log does not give: beam angles, no-return value, maximum range, mounting."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.range_peaks import RangeLimitOptions, peak_at_limit
from nscan_cli.poses import Array, relative, wrap

RAD_PER_DEGREE = math.pi / 180
CARMEN_MAX_RANGE = 80.0
"""CARMEN's maximum range for messages that carry none, m."""
SICK_CODES = (81.825, 81.915)
"""A SICK LMS writes readings of 8183 to 8191 (13 bits, cm) if a return is too far or missing; in m."""


def beam_angles(beams: int) -> tuple[float, float]:
    """First direction and step (rad) of a message without angles, by CARMEN's convention.

    180 and 181 beams have a step of 1°, 360 and 361 one of 0.5°, all from −90° on, so that 180 beams end at
    +89°. 400 and 401 beams have 0.25° and are centred, as they cover 100° only. Others spread over 180°.
    """
    if beams in (400, 401):
        return -(beams - 1) / 2 * 0.25 * RAD_PER_DEGREE, 0.25 * RAD_PER_DEGREE
    known = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5}
    return -math.pi / 2, known.get(beams, 180.0 / max(beams - 1, 1)) * RAD_PER_DEGREE


def no_return_value(ranges: NDArray[np.float32]) -> float | None:
    """The smallest reading (m) that means "no return", from all readings of a log; None if there is none.

    Without a return a laser writes one fixed value above all that it can measure. SICK's codes are known. Any
    other value is a peak of the histogram within `top_range` of the largest reading. It is sharp, so that
    half of its readings share one centimetre, which noise prevents for a wall, and isolated, with
    `peak_ratio` times the readings of the metre below. Or it is a single value there with `peak_ratio` times
    the readings of any other in that metre. At least `distinct_readings` must be lower.
    """
    options = RangeLimitOptions()
    usable = ranges[(ranges > 0) & (ranges < options.largest_range)]
    if usable.size == 0:
        return None
    largest = float(usable.max())
    low, high = SICK_CODES
    if low <= largest <= high:
        return _rounded(usable[usable > low].min())
    near = usable[usable > largest - (options.top_range + options.compared_range)]
    values, counts = np.unique(np.rint(near.astype(np.float64) * 100).astype(np.int64), return_counts=True)
    top = values > round((largest - options.top_range) * 100)
    peak, below = int(counts[top].sum()), int(counts[~top].sum())
    sharpest = int(counts[top].max())
    if peak < options.peak_readings or 2 * sharpest < peak or peak < options.peak_ratio * below:
        return _single_value(usable, largest)
    least = int(values[top & (counts >= options.top_share * sharpest)].min()) / 100 - 0.005
    if not _are_many_values(usable[usable < least]):
        return None
    return _rounded(usable[usable >= least].min())


def _single_value(usable: NDArray[np.float32], largest: float) -> float | None:
    """The no-return value among readings (N,) above 0 if readings of a wall may lie near it."""
    options = RangeLimitOptions()
    values, counts = np.unique(usable[usable > largest - options.top_range], return_counts=True)
    value, count = values[counts.argmax()], counts.max()
    limit = np.array([value], dtype=np.float64)
    stands_out = peak_at_limit(usable[None], limit, -1, options.peak_ratio)
    if stands_out is None or options.peak_ratio * np.count_nonzero(usable > value) > count:
        return None
    return _rounded(value) if _are_many_values(usable[usable < value]) else None


def _are_many_values(readings: NDArray[np.float32]) -> bool:
    """Whether readings (N,) have enough distinct values; mostly the first of them tell."""
    least = RangeLimitOptions.distinct_readings
    return any(np.unique(some).size >= least for some in (readings[: 100 * least], readings))


def _rounded(value: np.float32) -> float:
    """The value rounded to mm, if that is not larger."""
    rounded = round(float(value), 3)
    return rounded if np.float32(rounded) <= value else float(value)


def mark_no_returns(ranges: NDArray[np.float32], low: Array, high: Array) -> None:
    """Write inf for readings at or above the upper limits and nan for those at or below the lower, in place.

    ranges (S, B), limits (S,), m. A reading that is 0, negative or no number becomes nan, and so do all
    readings of a scan whose lower limit is not below the upper.
    """
    with np.errstate(invalid="ignore"):
        ranges[ranges >= high[:, None].astype(np.float32)] = np.inf
        ranges[~(ranges > low[:, None].astype(np.float32))] = np.nan
    ranges[low >= high] = np.nan


def mount_from_poses(laser: Array, robot: Array) -> Array:
    """The pose (3,) of the laser on the robot from poses (S, 3) of both in one frame: the median over scans.

    Rounded to 1e-6, the precision of logs.
    """
    mounts = relative(laser, robot)
    first = mounts[0, 2]
    angle = wrap(first + np.median(wrap(mounts[:, 2] - first)))
    mount = np.array([np.median(mounts[:, 0]), np.median(mounts[:, 1]), angle])
    rounded: Array = np.round(mount, 6) + 0.0
    return rounded
