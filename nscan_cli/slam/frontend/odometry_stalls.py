"""Odometry that stands still for some scans while the robot drives on, and then makes up for it in one step.

A robot whose computer is busy reports an old pose for a while. The way is right in the end; where it lies in
between is not known, and steady motion is the best guess.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array, Indices, compose, relative


class OdometryStallOptions(NamedTuple):
    """When odometry stood still while the robot drove on, and made up for it in one step."""

    min_steps: int = 2
    """Least number of steps in which odometry stands. With a smaller number, odometry slower than the scans
    would count as a stall."""
    min_motion: float = 0.1
    """Least length of the step that catches up, m + rad: a smaller one does not mislead a match. A larger
    value evens out fewer stalls."""
    factor: float = 2.0
    """The step that catches up is faster than those before and after it by this factor; averaged over the
    stall, the robot is not. A larger value evens out fewer stalls."""


def without_stalls(odometry: Array, times: Array, options: OdometryStallOptions) -> tuple[Array, Indices]:
    """Odometry (S, 3) whose stalls are evened out, and the rows (J,) with which they end; times (S,) in s.

    The step that makes up for a stall is shared out over its scans in proportion to time.
    """
    ends: list[int] = []
    if len(odometry) < 4:
        return odometry, np.array(ends, dtype=np.int64)
    steps, periods = relative(odometry[1:], odometry[:-1]), np.diff(times)
    sizes = np.hypot(steps[:, 0], steps[:, 1]) + np.abs(steps[:, 2])
    stands, evened = (odometry[1:] == odometry[:-1]).all(axis=1), odometry.copy()
    # Steps first to end − 1 stand; the step at `end` makes up for them.
    changes = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(np.int8)))
    for first, end in changes.reshape(-1, 2).tolist():
        if end - first < options.min_steps or first == 0 or end + 1 >= len(steps):
            continue
        since, until = times[first], times[end + 1]
        if sizes[end] < options.min_motion or not (periods[[first - 1, end, end + 1]] > 0.0).all():
            continue
        beside = sizes[[first - 1, end + 1]] / periods[[first - 1, end + 1]]
        slowest, fastest = beside.min() / options.factor, beside.max() * options.factor
        if sizes[end] >= fastest * periods[end] and slowest < sizes[end] / (until - since) < fastest:
            shares = (times[first + 1 : end + 1] - since) / (until - since)
            evened[first + 1 : end + 1] = compose(odometry[first], shares[:, None] * steps[end])
            ends.append(end + 1)
    return evened, np.array(ends, dtype=np.int64)
