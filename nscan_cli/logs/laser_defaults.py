"""What a log does not say about its laser: beam angles, no-return values, range limits, mounting."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.range_peaks import MIN_PEAK_READINGS, peak_at_limit
from nscan_cli.poses import Array, relative, wrap

RAD = math.pi / 180
CARMEN_MAX_RANGE = 80.0
"""CARMEN's maximum range (m) for messages that carry none."""
SICK_CODES = (81.825, 81.915)
"""Readings 8183 to 8191 (13 bits, cm) of a SICK LMS mean: beyond the maximum, or not measured."""
DISTINCT = 50
"""So many different readings tell one from others."""


def beam_angles(beams: int) -> tuple[float, float]:
    """First direction and step (rad) of a message without angles, by CARMEN's convention.

    180 and 181 beams have 1°, 360 and 361 0.5°, all from −90° on, so that 180 beams end at +89°; 400
    and 401 have 0.25° and are centred, since their 100° do not begin at −90°; others spread over 180°.
    """
    if beams in (400, 401):
        return -(beams - 1) / 2 * 0.25 * RAD, 0.25 * RAD
    known = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5}
    return -math.pi / 2, known.get(beams, 180.0 / max(beams - 1, 1)) * RAD


def no_return_value(ranges: NDArray[np.float32]) -> float | None:
    """The least reading (m) that stands for "no return", found in the readings of a whole log, or None.

    A laser without an echo writes one fixed value above all that it can measure. SICK's codes are known
    and taken as such. Any other value is told by its place in the histogram: a peak within 0.25 m of the
    largest reading that is sharp (half of its readings share one centimetre, which noise does not allow
    a wall) and stands alone (ten times the readings of the metre below), or else a single value there with
    ten times the readings of any other in that metre. A log of fewer than 50 distinct lower readings is too
    small to tell.
    """
    usable = ranges[(ranges > 0) & (ranges < 1e4)]
    if usable.size == 0:
        return None
    largest = float(usable.max())
    low, high = SICK_CODES
    if low <= largest <= high:
        return _rounded(usable[usable > low].min())
    centimetres = np.rint(usable[usable > largest - 1.25].astype(np.float64) * 100).astype(np.int64)
    values, counts = np.unique(centimetres, return_counts=True)
    top = values > round((largest - 0.25) * 100)
    peak, below = int(counts[top].sum()), int(counts[~top].sum())
    sharpest = int(counts[top].max())
    if peak < MIN_PEAK_READINGS or 2 * sharpest < peak or peak < 10 * below:
        return _single_value(usable, largest)
    least = int(values[top & (counts >= 0.01 * sharpest)].min()) / 100 - 0.005
    lower = usable[usable < least]
    if np.unique(lower).size < DISTINCT:
        return None
    return _rounded(usable[usable >= least].min())


def _single_value(usable: NDArray[np.float32], largest: float) -> float | None:
    """What no_return_value returns where readings of a wall may lie about, from readings (N,) above 0."""
    values, counts = np.unique(usable[usable > largest - 0.25], return_counts=True)
    value, count = values[counts.argmax()], counts.max()
    stands_out = peak_at_limit(usable[None], np.array([value], dtype=np.float64), inside=-1, times=10.0)
    if stands_out is None or 10 * np.count_nonzero(usable > value) > count:
        return None
    return _rounded(value) if np.unique(usable[usable < value]).size >= DISTINCT else None


def _rounded(value: np.float32) -> float:
    """In mm where that is the same value or less."""
    rounded = round(float(value), 3)
    return rounded if np.float32(rounded) <= value else float(value)


def mark_no_returns(ranges: NDArray[np.float32], low: Array, high: Array) -> None:
    """Write inf for readings at or above the upper limits, nan for those at or below the lower; in place.

    ranges (S, B), limits (S,), m. A reading of 0 or less, or one that is not a number, says nothing and
    becomes nan, and so do all of a scan whose lower limit is not below the upper.
    """
    with np.errstate(invalid="ignore"):
        ranges[ranges >= high[:, None].astype(np.float32)] = np.inf
        ranges[~(ranges > low[:, None].astype(np.float32))] = np.nan
    ranges[low >= high] = np.nan


def mount_from_poses(laser: Array, robot: Array) -> Array:
    """The laser's pose (3,) on the robot from poses (S, 3) of both in one frame: the median over scans.

    Rounded to 1e-6, the precision that logs are written with.
    """
    mounts = relative(laser, robot)
    first = mounts[0, 2]
    angle = wrap(first + np.median(wrap(mounts[:, 2] - first)))
    mount = np.array([np.median(mounts[:, 0]), np.median(mounts[:, 1]), angle])
    rounded: Array = np.round(mount, 6) + 0.0
    return rounded
