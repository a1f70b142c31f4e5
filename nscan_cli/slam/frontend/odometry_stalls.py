"""Odometry that falls behind the robot for some scans and makes up for it, or runs ahead and waits.

A robot whose computer is busy reports an old pose for a while, or with a wrong stamp. The way is right in the
end; where it lies in between is not known, and steady motion is the best guess.
"""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.robot_path import steady_between
from nscan_cli.poses import Array, Indices, Mask, relative

STEP_DECIMALS = 9
"""Of metres and rad, to which uneven steps are compared: the direction of time changes the last digits."""


class OdometryStallOptions(NamedTuple):
    """When odometry fell behind the robot, and made up for it."""

    min_steps: int = 2
    """Least number of steps in which odometry stands, for one step that makes up for all of them. With a
    smaller number, odometry slower than the scans would count as a stall."""
    min_motion: float = 0.1
    """Least length of the step that makes up for them, and least error of the longest and of the shortest of
    uneven steps, m + rad: a smaller one does not mislead a match. A larger value evens out fewer stalls."""
    factor: float = 2.0
    """The step that makes up for a stall is faster than those before and after it by this factor; averaged
    over the stall, the robot is not. A larger value evens out fewer stalls."""
    most_uneven_steps: int = 4
    """Largest number of steps, some too short and some too long, that are evened out together. A larger value
    evens out more."""
    uneven_factor: float = 1.5
    """Of uneven steps one is faster than those before and after them by this factor, and one is slower. A
    larger value evens out fewer."""
    steady_factor: float = 1.3
    """Largest factor between the speeds before and after uneven steps; their mean speed differs from these by
    no more than its root. A larger value evens out more."""
    period_factor: float = 1.3
    """Largest factor between the durations of these steps: where scans come unevenly, their own stamps may be
    wrong. A larger value evens out more."""
    min_acceleration: float = 3.0
    """The speed of uneven steps changes faster than this from one to the next, (m + rad)/s²: no robot drives
    so. A larger value evens out fewer."""
    min_named: float = 0.3
    """Least correction of a pose that a notice names, m + rad. A larger value names fewer stalls."""


class OdometrySteps(NamedTuple):
    """The steps of odometry from scan to scan, N of them."""

    sizes: Array
    """(N,) lengths, m + rad"""
    periods: Array
    """(N,) s"""
    stands: Mask
    """(N,) whether the pose stays exactly the same"""

    def speeds(self) -> Array:
        """(N,) m/s + rad/s; nan for a step without duration."""
        speeds = np.full(len(self.sizes), np.nan)
        np.divide(self.sizes, self.periods, out=speeds, where=self.periods > 0.0)
        return speeds

    def reversed(self) -> OdometrySteps:
        """The steps backwards in time."""
        return OdometrySteps(self.sizes[::-1], self.periods[::-1], self.stands[::-1])


def without_stalls(odometry: Array, times: Array, options: OdometryStallOptions) -> tuple[Array, Indices]:
    """Odometry (S, 3) with stalls evened out, and the rows (J,) with which large ones end; times (S,) in s.

    The way over the scans of a stall is shared out over them in proportion to time. Backwards in time, a step
    makes up for what comes after it.
    """
    if len(odometry) < 4:
        return odometry, np.zeros(0, dtype=np.int64)
    steps = _steps(odometry, times)
    last = len(steps.sizes)
    stalls = _stalls(steps, 0.0, options)
    backwards = _stalls(steps.reversed(), options.min_acceleration, options)
    stalls += [(last - end, last - first) for first, end in backwards]
    evened = steady_between(odometry, times, stalls)
    uneven = _uneven_steps(_steps(evened, times), options)
    evened = steady_between(evened, times, uneven)
    corrections = _sizes(relative(evened, odometry))
    ends = [end for first, end in stalls + uneven if corrections[first + 1 : end].max() >= options.min_named]
    return evened, np.unique(ends).astype(np.int64)


def _steps(odometry: Array, times: Array) -> OdometrySteps:
    sizes = _sizes(relative(odometry[1:], odometry[:-1]))
    return OdometrySteps(sizes, np.diff(times), (odometry[1:] == odometry[:-1]).all(axis=1))


def _sizes(motions: Array) -> Array:
    """(N,) lengths of motions (N, 3), m + rad."""
    return np.hypot(motions[:, 0], motions[:, 1]) + np.abs(motions[:, 2])


def _stalls(
    steps: OdometrySteps, min_acceleration: float, options: OdometryStallOptions
) -> list[tuple[int, int]]:
    """The rows between which odometry stands, and makes up for it in the last step.

    Its speed rises by at least `min_acceleration` there, (m + rad)/s².
    """
    speeds, found = steps.speeds(), []
    # OdometrySteps first to end − 1 stand; the step at `end` makes up for them.
    for first, end in mask_runs(steps.stands):
        if end - first < options.min_steps or first == 0 or end + 1 >= len(steps.sizes):
            continue
        size, periods = steps.sizes[end], steps.periods[[first - 1, end, end + 1]]
        if size < options.min_motion or not (periods > 0.0).all():
            continue
        beside = speeds[[first - 1, end + 1]]
        slowest, fastest = beside.min() / options.factor, beside.max() * options.factor
        duration = float(steps.periods[first : end + 1].sum())
        acceleration = (size / periods[1] - beside.max()) / periods[1]
        if (
            size >= fastest * periods[1]
            and slowest < size / duration < fastest
            and acceleration >= min_acceleration
        ):
            found.append((first, end + 1))
    return found


def _uneven_steps(steps: OdometrySteps, options: OdometryStallOptions) -> list[tuple[int, int]]:
    """The rows between which some steps are too short and others too long.

    The fewest steps count first, then the most uneven; of those that overlap and are as uneven, none. So the
    direction of time does not matter.
    """
    candidates = []
    for count in range(2, min(options.most_uneven_steps, len(steps.sizes) - 2) + 1):
        spreads = _spreads(steps, count, options)
        candidates += [(count, -spreads[row], int(row) + 1) for row in np.flatnonzero(spreads)]
    is_taken = np.zeros(len(steps.sizes), dtype=np.bool_)
    found = []
    for (count, _), tied in groupby(sorted(candidates), itemgetter(0, 1)):
        firsts = [first for _, _, first in tied if not is_taken[first : first + count].any()]
        for first in firsts:
            if all(abs(first - other) >= count for other in firsts if other != first):
                is_taken[first : first + count] = True
                found.append((first, first + count))
    return found


def _spreads(steps: OdometrySteps, count: int, options: OdometryStallOptions) -> Array:
    """The spread of `count` successive steps about steady motion, m + rad.

    The first value is that of the steps from the second on, the next that of those from the third on, and so
    on. It is 0 where they are no steady motion with wrong stamps.
    """
    speeds = steps.speeds()
    sizes, periods, within = (
        sliding_window_view(values[1:-1], count) for values in (steps.sizes, steps.periods, speeds)
    )
    times = sliding_window_view(steps.periods, count + 2)
    changes = np.abs(np.diff(sliding_window_view(speeds, count + 2), axis=1))
    before, after = speeds[: len(sizes)], speeds[count + 1 :]
    slower, faster = np.minimum(before, after), np.maximum(before, after)
    # Steps that share a stamp have no speed, and are not steady.
    durations, mean = periods.sum(axis=1), np.full(len(sizes), np.nan)
    np.divide(sizes.sum(axis=1), durations, out=mean, where=durations > 0.0)
    off = sizes - mean[:, None] * periods
    tolerated, beside = np.sqrt(options.steady_factor), 0.5 * (before + after)
    is_steady = (slower > 0.0) & (faster <= options.steady_factor * slower)
    is_steady &= times.max(axis=1) <= options.period_factor * times.min(axis=1)
    is_steady &= changes.max(axis=1) >= options.min_acceleration * times.min(axis=1)
    is_steady &= (mean > beside / tolerated) & (mean < beside * tolerated)
    has_slow = (within.min(axis=1) < slower / options.uneven_factor) & (off.min(axis=1) < -options.min_motion)
    has_fast = (within.max(axis=1) > faster * options.uneven_factor) & (off.max(axis=1) > options.min_motion)
    return np.where(is_steady & has_slow & has_fast, np.ptp(off, axis=1).round(STEP_DECIMALS), 0.0)
