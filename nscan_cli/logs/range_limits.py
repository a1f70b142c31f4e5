"""The range limits of a laser, from options, the log, or the readings themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_defaults import no_return_value
from nscan_cli.logs.range_peaks import ROUNDING, RangeLimitOptions, peak_at_limit
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array

FROM_READINGS = "the no-return value found in the readings"


class RangeLimits(NamedTuple):
    """The limits in force of each scan: a reading r is usable if low < r < high."""

    low: Array
    """(S,) lower limits, m"""
    high: Array
    """(S,) upper limits, m"""
    no_return: float | None
    """Smallest reading that means "no return", m"""
    low_from: str
    """Origin of the lower limits"""
    high_from: str
    """Origin of the upper limits"""

    def of(self, rows: NDArray[np.int64]) -> RangeLimits:
        """The limits of some scans."""
        return self._replace(low=self.low[rows], high=self.high[rows])

    @property
    def whole(self) -> tuple[float, float]:
        """The smallest lower and the largest upper limit (m) of all scans."""
        return float(self.low.min()), float(self.high.max())


def limits_in_force(raw: RawScans, options: ReadingOptions, warnings: list[str]) -> RangeLimits:
    """The limits from the options, else from the log, and at most the value that means "no return".

    That value is searched among all readings, and at the limits, which drivers write for readings beyond.
    """
    scans = len(raw.stamps)
    low, high = (np.array(np.broadcast_to(limit, scans), dtype=np.float64) for limit in raw.limits)
    low_from, high_from = raw.limits_from
    no_return = no_return_value(raw.ranges)
    if options.max_range is None:
        end = RangeLimitOptions.largest_range if no_return is None else no_return
        high, high_from = _upper_limits(raw, high, high_from, end, warnings)
    gap = peak_at_limit(raw.ranges, low, inside=1)
    if gap is not None:
        low, low_from = low + gap, f"{low_from}, at a peak of invalid readings"
    if options.min_range is not None:
        low, low_from = np.full(scans, options.min_range), "--min-range"
    gap = peak_at_limit(raw.ranges, high, inside=-1)
    if gap is not None and options.max_range is not None:
        beyond = (raw.ranges > high[:, None]) & (raw.ranges < options.max_range)
        # If more than a few readings lie beyond, the user asks for these.
        gap = None if np.count_nonzero(beyond) >= RangeLimitOptions.peak_readings else gap
    if gap is not None:
        high, high_from = high - gap, f"{high_from}, at a peak of readings without return"
        if (high == high[0]).all():
            no_return = float(high[0]) if no_return is None else min(float(high[0]), no_return)
    if options.max_range is not None and (gap is None or options.max_range < high.min()):
        high, high_from = np.full(scans, options.max_range), "--max-range"
    if no_return is not None and no_return < high.max():
        high, high_from = np.minimum(high, no_return), FROM_READINGS
    return RangeLimits(low, high, no_return, low_from, high_from)


def _upper_limits(
    raw: RawScans, high: Array, high_from: str, end: float, warnings: list[str]
) -> tuple[Array, str]:
    """The upper limits (S,) that the log names, and their origin.

    A limit that may not be the laser's own is used unless returns continue beyond it. If returns continue
    beyond a limit that is used, the user is told.
    """
    for limit, source in sorted(raw.doubtful):
        if limit >= high.max():
            continue
        share = returns_beyond(raw.ranges, limit, min(end, float(high.max())))
        if share == 0.0:
            return np.minimum(high, limit), source
        warnings.append(
            f"{source} is {limit:g} m, but {_percent(share)} of the returns lie beyond: it is not a limit "
            f"of the laser and is not used; --max-range {limit:g} would use it"
        )
    if (high == high[0]).all():
        share = returns_beyond(raw.ranges, float(high[0]), end)
        if RangeLimitOptions.min_reported_share <= share <= RangeLimitOptions.max_reported_share:
            warnings.append(
                f"{_percent(share)} of the returns lie beyond {high[0]:g} m ({high_from}) and are read as "
                "no return; if they are valid, give a larger --max-range"
            )
    return high, high_from


def returns_beyond(ranges: NDArray[np.float32], limit: float, end: float) -> float:
    """The share of returns from `limit` to `end` (m) if returns continue beyond the limit; else 0.

    Beyond a laser's own limit there are no returns, one single value, or far fewer than just below it, and
    the readings may have a peak at it.
    """
    checks = RangeLimitOptions()
    returns = ranges[(ranges > 0) & (ranges < end)]
    beyond = returns[returns > limit * (1 + ROUNDING)]
    if beyond.size < checks.peak_readings:
        return 0.0
    _, counts = np.unique(np.rint(beyond * 100), return_counts=True)
    near, far, slack = limit / checks.neighbourhood, limit * checks.neighbourhood, limit * (1 + ROUNDING)
    below = np.count_nonzero((returns >= near) & (returns <= slack))
    drops = np.count_nonzero(beyond <= far) < checks.max_drop * below
    if drops or 2 * counts.max() >= beyond.size:
        return 0.0
    if peak_at_limit(ranges, np.full(len(ranges), limit), -1) is not None:
        return 0.0
    return float(beyond.size / returns.size)


def _percent(share: float) -> str:
    return f"{100 * share:.2g}%"
