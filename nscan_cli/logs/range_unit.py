"""The unit of the readings: metres, unless the scans say another one, or an option does."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.range_peaks import RangeLimitOptions
from nscan_cli.logs.raw_scans import RawScans

UNITS = (("millimetres", 0.001), ("centimetres", 0.01))
"""Units that a log may have instead of metres, in metres."""
DIVIDED = (("metres divided by 100", 100.0), ("metres divided by 1000", 1000.0))
"""What a log has if a driver and its recorder both take metres for another unit, in metres."""


@dataclass(frozen=True)
class RangeUnitOptions:
    """When the readings are not in metres."""

    min_median: float = 0.2
    """Least median reading of a plausible unit, m. A larger value takes fewer units for possible."""
    max_median: float = 40.0
    """Largest median reading of a plausible unit, m; it bounds metres too. A larger value warns of fewer
    logs."""
    near_median: float = 0.05
    """Below this median reading the unit cannot be metres, m: lasers see nothing nearer. A larger value
    corrects more logs."""
    near_spread: float = 1.1
    """The upper quartile of such readings is more than this multiple of their median: those of a covered
    laser are alike. A larger value corrects fewer logs."""
    remote_median: float = 100.0
    """From this median reading on, the unit cannot be metres, m. A larger value corrects fewer logs."""
    typical_median: float = 3.0
    """Median reading that is expected, m. A larger value prefers larger units."""
    certain_factor: float = 4.0
    """A unit is certain if the median is within this factor of the typical one. A larger value corrects more
    logs."""
    unlikely_factor: float = 6.0
    """Least factor by which the median in every other unit is off the typical one, if a unit is certain. A
    larger value corrects fewer logs."""
    min_returns: int = 50
    """Least number of returns that make a unit certain. A larger value corrects fewer logs."""
    limits_apart: float = 1.0
    """Lower limits of lasers are less, and upper limits are more, m: it tells in which unit a limit is. A
    larger value leaves more limits as they are."""
    max_neighbour_change: float = 0.3
    """Largest median difference of neighbouring readings, as a share of the median reading: those of walls
    differ by 0.05 at most, and random numbers by 0.5. A larger value takes more numbers for ranges."""
    sample: int = 1 << 17
    """Number of readings from which the unit is told. A larger value takes longer."""


class WrongUnit(NamedTuple):
    """The unit that the readings of a log seem to have in place of metres."""

    name: str
    scale: float
    """m"""
    median: float
    """Median of the readings as written."""
    others: tuple[float, ...]
    """Scales of the other units that the readings may have, m."""
    is_certain: bool
    """Whether it is beyond doubt."""

    @property
    def seems(self) -> str:
        """What is wrong, as a part of a sentence."""
        where = f"beyond {self.median:,.0f}" if self.scale < 1.0 else f"below {self.median:.2g}"
        return f"half of the returns are {where}, which looks like {self.name}"

    @property
    def remedy(self) -> str:
        """The option to give."""
        scales = " or ".join(f"{scale:g}" for scale in (self.scale, *self.others))
        return f"ranges must be in metres: give --range-scale {scales}"

    @property
    def correction(self) -> str:
        """The message if the unit is put right."""
        return (
            f"{self.seems}: the ranges are multiplied by {self.scale:g}; --as-recorded leaves them as they "
            "are, --range-scale sets another factor"
        )


def wrong_unit(ranges: NDArray[np.float32], limits: RangeLimits) -> WrongUnit | None:
    """The unit of readings (S, B) as written; None for metres, or if no unit fits.

    The unit is wrong if the median return is beyond the limits, or implausibly large or small, and three
    quarters of the returns would be within the limits in another unit.
    """
    options = RangeUnitOptions()
    some = ranges.reshape(-1)[:: -(-ranges.size // options.sample)]
    some = some[(some > 0) & np.isfinite(some)]
    some = some[some < end_of_distances(some, limits.no_return)]
    if not some.size:
        return None
    highest = float(limits.high.max())
    plausible = min(highest, options.max_median)
    # To count is quicker than to sort, and mostly it tells.
    is_near = 2 * np.count_nonzero(some < options.near_median) > some.size
    if not is_near and 2 * np.count_nonzero(some < plausible) > some.size:
        return None
    if is_near and highest < options.limits_apart:
        # The limit was divided, too.
        highest = math.inf
    median, upper_quartile = (float(value) for value in np.quantile(some, (0.5, 0.75)))
    if upper_quartile <= options.near_spread * median if is_near else median < plausible:
        return None
    fitting = sorted(
        (abs(math.log(median * scale / options.typical_median)), name, scale)
        for name, scale in (DIVIDED if is_near else UNITS)
        if options.min_median <= median * scale <= options.max_median and upper_quartile * scale < highest
    )
    if not fitting or not _are_of_walls(ranges, median, options):
        return None
    (off, name, scale), *others = fitting
    near, far = math.log(options.certain_factor), math.log(options.unlikely_factor)
    is_certain = (is_near or median >= options.remote_median) and some.size >= options.min_returns
    is_certain &= off <= near and all(other[0] > far for other in others)
    return WrongUnit(name, scale, median, tuple(other[2] for other in others), is_certain)


def _are_of_walls(ranges: NDArray[np.float32], median: float, options: RangeUnitOptions) -> bool:
    """Whether neighbouring readings (S, B) are alike: intensities in place of ranges are often not."""
    some = ranges[:: -(-ranges.size // options.sample)]
    some = np.where((some > 0) & np.isfinite(some), some, np.nan)
    changes = np.abs(np.diff(some, axis=1))
    changes = changes[np.isfinite(changes)]
    return not changes.size or float(np.median(changes)) <= options.max_neighbour_change * median


def end_of_distances(readings: NDArray[np.float32], no_return: float | None) -> float:
    """The value from which on readings (N,) are of no distance: that which seems to mean "no return"; inf if
    there is none, or most readings are far beyond it, and differ. Among whole numbers, any looks like a peak.
    """
    if no_return is None:
        return math.inf
    beyond = readings[readings > RangeLimitOptions.neighbourhood * no_return]
    if 2 * beyond.size <= readings.size:
        return no_return
    _, counts = np.unique(beyond, return_counts=True)
    return math.inf if 2 * counts.max() < beyond.size else no_return


def scaled(raw: RawScans, scale: float, options: RangeUnitOptions = RangeUnitOptions()) -> RawScans:
    """The scans with ranges multiplied by `scale`; limits that were in the same unit are, too.

    An upper limit was in another unit if the median return is beyond it. No limit may become one that no
    laser has.
    """
    returns = raw.ranges[(raw.ranges > 0) & np.isfinite(raw.ranges)]
    median = float(np.median(returns)) if returns.size else 0.0
    low, high = (np.asarray(limit, dtype=np.float64) for limit in raw.limits)
    shares_unit = (
        (high < RangeLimitOptions.largest_range) & (high >= median) & (high * scale >= options.limits_apart)
    )
    if scale > 1.0:
        # Half of the returns would be beyond it otherwise.
        shares_unit &= (high < options.limits_apart) | (median * scale > high)
    # That is assumed, in metres.
    shares_unit &= high != CARMEN_MAX_RANGE
    low = np.where(low >= options.limits_apart, low * scale, low)
    limits = low, np.where(shares_unit, high * scale, high)
    return replace(raw, ranges=raw.ranges * np.float32(scale), limits=limits)
