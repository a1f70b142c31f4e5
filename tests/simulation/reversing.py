"""Drives with stretches in reverse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from tests.logs.excerpts import excerpt


def there_and_back(log: LaserLog, stretches: list[tuple[int, int]], stop: int = 3) -> LaserLog:
    """From the last row of each stretch the robot reverses to its first row, and drives to the last again.

    It stands for `stop` scans before and after it reverses. Scans come as regularly as before.
    """
    rows, begin = list[int](), 0
    for first, last in stretches:
        rows += [*range(begin, last), *[last] * stop, *range(last - 1, first, -1), *[first] * stop]
        begin = first + 1
    rows += range(begin, len(log))
    period = float(np.median(np.diff(log.times)))
    times = log.times[0] + period * np.arange(len(rows))
    return replace(
        excerpt(log, np.array(rows)),
        numbers=np.arange(len(rows)),
        stamps=tuple(f"{time:.6f}" for time in times),
        times=times,
        truth_times=None if log.truth is None else times,
    )
