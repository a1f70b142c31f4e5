"""One reading that stands all over the scans: what a driver writes where the laser saw nothing.

Readings of walls have many values, those beside each other about as often as each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.range_limits import RangeLimits


@dataclass(frozen=True)
class RepeatedReadingOptions:
    """When one reading is no distance."""

    scans: int = 32
    """Number of scans that are looked at, evenly spread. More take longer."""
    min_readings: int = 100
    """Least number of usable readings in these. A larger number looks at fewer logs."""
    min_share: float = 0.01
    """Least share of them that has exactly this value. It is 0.06 at most on real logs, where others beside
    it are as many. A larger value leaves less out."""
    max_share: float = 0.6
    """Greatest share: with a larger value more is left out, and less remains to make a map from."""
    near: float = 0.25
    """Readings within this distance are beside it, m. A larger value leaves less out."""
    ratio_to_near: float = 10.0
    """Least ratio to the number of any value beside it. It is 2 at most on real logs. A larger value leaves
    less out."""
    ratio_to_others: float = 3.0
    """Least ratio to the number of any other value: walls in ranges rounded to half a metre have nothing
    beside them. A larger value leaves less out."""
    min_beams: float = 0.25
    """Least share of the beams that have it in some of the scans. A larger value leaves less out."""
    always: float = 0.9
    """Beams that have it in a larger share of the scans do not count: they are dead, or see the robot."""


def repeated_reading(
    ranges: NDArray[np.float32],
    limits: RangeLimits,
    options: RepeatedReadingOptions = RepeatedReadingOptions(),
) -> tuple[float, float] | None:
    """The reading (m) among ranges (S, B) that is no distance, and its share of the usable ones; None if all
    are distances."""
    if not len(ranges):
        return None
    rows = np.unique(np.linspace(0, len(ranges) - 1, options.scans).astype(np.int64))
    some, of_rows = ranges[rows], limits.of(rows)
    low, high = (limit[:, None].astype(np.float32) for limit in (of_rows.low, of_rows.high))
    with np.errstate(invalid="ignore"):
        is_usable = (some > low) & (some < high)
    values, counts = np.unique(some[is_usable], return_counts=True)
    total = int(counts.sum())
    if total < options.min_readings:
        return None
    best = int(counts.argmax())
    value, count = values[best], int(counts[best])
    others = np.delete(counts, best)
    beside = others[np.abs(np.delete(values, best) - value) <= options.near]
    is_alone = count >= options.ratio_to_near * beside.max(initial=1)
    is_alone &= count >= options.ratio_to_others * others.max(initial=1)
    if not is_alone or not options.min_share <= count / total <= options.max_share:
        return None
    shares = (some == value).mean(axis=0)
    sometimes = np.count_nonzero((shares > 0.0) & (shares <= options.always))
    return (float(value), count / total) if sometimes >= options.min_beams * len(shares) else None


def without_repeated_reading(
    ranges: NDArray[np.float32], limits: RangeLimits
) -> tuple[NDArray[np.int64], list[str]]:
    """Write nan for a reading among ranges (S, B) that is no distance, in place.

    Returns how many readings of each scan (S,) were so, and what is said.
    """
    found = repeated_reading(ranges, limits)
    if found is None:
        return np.zeros(len(ranges), dtype=np.int64), []
    value, share = found
    is_so = ranges == np.float32(value)
    counts = np.count_nonzero(is_so, axis=1).astype(np.int64)
    ranges[is_so] = np.nan
    return counts, [
        f"{share:.0%} of the readings are exactly {value:.4g} m, in all directions, and hardly any are about "
        "it: it stands for no reading, and they are left out; --as-recorded uses them"
    ]
