"""The unit of time stamps: seconds, unless these would be too large, or scans would come too seldom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array


@dataclass(frozen=True)
class StampUnitOptions:
    """When stamps are not in seconds."""

    shortest_period: float = 0.02
    """Shortest usual time between scans, s: a laser of more than 50 Hz in milliseconds passes for a slow one
    in seconds. A smaller value puts more logs right, and may take one scan in 10 s for 100 scans a second."""
    latest: float = 1e11
    """Latest time, s: larger stamps count smaller units. A larger value converts fewer logs."""
    min_scans: int = 50
    """Least number of scans that tell. A larger value converts fewer logs."""
    steady_factor: float = 1.5
    """A period is steady if it is within this factor of the median. A larger value converts more logs."""
    min_steady_share: float = 0.8
    """Least share of periods that are steady: a laser keeps its period, and a robot that
    takes one scan at each stop does not. A larger value converts fewer logs."""


class StampUnit(NamedTuple):
    """A unit of time."""

    name: str
    seconds: float


UNITS_OF_TIME = (
    StampUnit("milliseconds", 1e-3),
    StampUnit("microseconds", 1e-6),
    StampUnit("nanoseconds", 1e-9),
)
"""Units that stamps may have instead of seconds."""


def stamp_unit(stamps: Array, options: StampUnitOptions = StampUnitOptions()) -> StampUnit | None:
    """The unit of stamps (n,), in the order of their scans and as written; None for seconds.

    nan are left out. Units are a thousand times each other, so that only one of them gives a period from the
    shortest one to a thousand times as much; in seconds all real logs are there. Their size alone does not
    tell it: 2,000 s since a computer was switched on, in nanoseconds, are the milliseconds from 1970 to 2033.
    """
    stamps = stamps[np.isfinite(stamps)]
    usual = float(np.median(np.abs(stamps))) if len(stamps) else 0.0
    period = _steady_period(stamps, options)
    units = [unit for unit in UNITS_OF_TIME if usual * unit.seconds <= options.latest]
    least = options.shortest_period
    by_period = [unit for unit in units if least <= period * unit.seconds < 1e3 * least]
    if usual > options.latest:
        return next(iter(by_period or units), None)
    return next(iter(by_period), None)


def _steady_period(stamps: Array, options: StampUnitOptions) -> float:
    """The usual time from stamp to stamp (n,), in their unit; 0 for few, or where it is not steady."""
    periods = np.abs(np.diff(stamps))
    periods = periods[periods > 0.0]
    if len(periods) < options.min_scans - 1:
        return 0.0
    period, factor = float(np.median(periods)), options.steady_factor
    is_steady = (factor * periods > period) & (periods < factor * period)
    return period if is_steady.mean() >= options.min_steady_share else 0.0
