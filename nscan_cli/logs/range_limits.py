"""From where to where a laser's readings count, and what says so: option, log, or the readings themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_defaults import no_return_value
from nscan_cli.logs.range_peaks import MIN_PEAK_READINGS, ROUNDING, peak_at_limit
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from nscan_cli.logs.assemble import RawScans

LARGEST_RANGE = 1e4
"""m; no reading is beyond, and no limit has to be said to be."""
FOUND = "the no-return value found in the readings"
ABOUT = 1.25
"""Within this factor of a distance, on both sides, there are about as many returns, if it is no limit."""
FALL = 0.1
"""There are so few beyond a limit for one inside that it is one."""
WORTH_SAYING, MOST = 0.05, 0.5
"""Shares of the returns; where more than MOST are beyond a limit, it is said how many count at all."""


class RangeLimits(NamedTuple):
    """The limits in force of each scan: a reading r counts when low < r < high."""

    low: Array
    """(S,) m"""
    high: Array
    """(S,) m"""
    no_return: float | None
    """The least value (m) that stands for "no return"."""
    low_from: str
    high_from: str

    def of(self, rows: NDArray[np.int64]) -> RangeLimits:
        """Those of some scans alone."""
        return self._replace(low=self.low[rows], high=self.high[rows])

    @property
    def whole(self) -> tuple[float, float]:
        """The least and the greatest limit (m) of all scans."""
        return float(self.low.min()), float(self.high.max())


def limits_in_force(raw: RawScans, options: ReadingOptions, warnings: list[str]) -> RangeLimits:
    """What the user says, else the log, but in no case farther than what stands for "no return".

    That is searched for among all readings, and at the limits: drivers write these for what is out of them.
    """
    scans = len(raw.stamps)
    low, high = (np.array(np.broadcast_to(limit, scans), dtype=np.float64) for limit in raw.limits)
    low_from, high_from = raw.limits_from
    no_return = no_return_value(raw.ranges)
    if options.max_range is None:
        end = LARGEST_RANGE if no_return is None else no_return
        high, high_from = _held_or_told(raw, high, high_from, end, warnings)
    gap = peak_at_limit(raw.ranges, low, inside=1)
    if gap is not None:
        low, low_from = low + gap, f"{low_from}, where readings pile up that say nothing"
    if options.min_range is not None:
        low, low_from = np.full(scans, options.min_range), "--min-range"
    gap = peak_at_limit(raw.ranges, high, inside=-1)
    if gap is not None and options.max_range is not None:
        beyond = (raw.ranges > high[:, None]) & (raw.ranges < options.max_range)
        # Where more than chance readings are beyond, these are what is asked for.
        gap = None if np.count_nonzero(beyond) >= MIN_PEAK_READINGS else gap
    if gap is not None:
        high, high_from = high - gap, f"{high_from}, where readings pile up that met nothing"
        if (high == high[0]).all():
            no_return = float(high[0]) if no_return is None else min(float(high[0]), no_return)
    if options.max_range is not None and (gap is None or options.max_range < high.min()):
        high, high_from = np.full(scans, options.max_range), "--max-range"
    if no_return is not None and no_return < high.max():
        high, high_from = np.minimum(high, no_return), FOUND
    return RangeLimits(low, high, no_return, low_from, high_from)


def _held_or_told(
    raw: RawScans, high: Array, high_from: str, end: float, warnings: list[str]
) -> tuple[Array, str]:
    """The upper limits (S,) that the log names, and where they are from.

    One that need not be the laser's own holds unless returns go on beyond it. Where they go on beyond one
    that holds, the user is told.
    """
    for limit, source in sorted(raw.doubtful):
        if limit >= high.max():
            continue
        share = returns_beyond(raw.ranges, limit, min(end, float(high.max())))
        if share == 0.0:
            return np.minimum(high, limit), source
        warnings.append(
            f"{source} is {limit:g} m, but returns go on beyond it ({_percent(share)} of them): it is no "
            f"limit of the laser and is not used; --max-range {limit:g} holds it"
        )
    if (high == high[0]).all():
        share = returns_beyond(raw.ranges, float(high[0]), end)
        if WORTH_SAYING <= share <= MOST:
            warnings.append(
                f"{_percent(share)} of the returns lie beyond {high[0]:g} m ({high_from}) and are taken for "
                "no return; if they are good, --max-range takes them"
            )
    return high, high_from


def returns_beyond(ranges: NDArray[np.float32], limit: float, end: float) -> float:
    """The share of returns beyond `limit` (m) where they go on beyond it, up to `end` (m); else 0.

    Beyond a laser's own limit there is nothing, or one value, or far less than just before; at it readings
    may pile up.
    """
    returns = ranges[(ranges > 0) & (ranges < end)]
    beyond = returns[returns > limit * (1 + ROUNDING)]
    if beyond.size < MIN_PEAK_READINGS:
        return 0.0
    _, counts = np.unique(np.rint(beyond * 100), return_counts=True)
    before = np.count_nonzero((returns >= limit / ABOUT) & (returns <= limit * (1 + ROUNDING)))
    falls = np.count_nonzero(beyond <= limit * ABOUT) < FALL * before
    if (
        falls
        or 2 * counts.max() >= beyond.size
        or peak_at_limit(ranges, np.full(len(ranges), limit), -1) is not None
    ):
        return 0.0
    return float(beyond.size / returns.size)


def _percent(share: float) -> str:
    return f"{100 * share:.2g}%"
