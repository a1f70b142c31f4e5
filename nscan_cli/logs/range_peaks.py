"""Peaks of readings at one value, which a driver writes for something other than a distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array

ROUNDING = 2e-6
"""Relative rounding error of a limit; that of 32 bits is smaller."""


@dataclass(frozen=True)
class RangeLimitOptions:
    """What a peak of readings is, and what limits of a laser."""

    largest_range: float = 1e4
    """No laser measures farther, m: larger readings and limits are ignored. A larger value believes more."""
    peak_readings: int = 20
    """Least number of readings of a peak at one value. A larger value finds fewer peaks."""
    peak_distance: float = 0.0015
    """Largest distance of a peak from a limit, m. A larger value finds more peaks."""
    compared_range: float = 1.0
    """Range beside a limit whose readings are compared with a peak, m. A larger value compares more."""
    peak_ratio: float = 10.0
    """Least ratio of a peak to the mean count of the values compared. A larger value finds fewer peaks."""
    peak_ratio_to_largest: float = 2.0
    """Least ratio of a peak at a limit to the largest count compared. A larger value finds fewer peaks."""
    top_range: float = 0.25
    """Range below the largest reading in which "no return" is looked for, m. A larger value looks farther."""
    top_share: float = 0.01
    """Least share of the sharpest count that belongs to its peak. A larger value narrows peaks."""
    distinct_readings: int = 50
    """Least distinct readings below a value for "no return". A larger value finds it in fewer logs."""
    neighbourhood: float = 1.25
    """Factor up to which returns are just below or beyond a distance. A larger value compares more."""
    max_drop: float = 0.1
    """Largest ratio of returns just beyond a limit to those just below. A larger value finds more limits."""
    min_reported_share: float = 0.05
    """Least share of returns beyond a limit of which the user is told. A larger value tells less."""
    max_reported_share: float = 0.5
    """Largest share of returns beyond a limit of which the user is told: with more, another warning gives the
    number of usable readings. A larger value tells more."""
    max_lost_share: float = 0.9
    """If a larger share of the readings is unusable, the user is told. A larger value tells less."""


def peak_at_limit(
    ranges: NDArray[np.float32],
    limits: Array,
    inside: int,
    ratio_to_largest: float = RangeLimitOptions.peak_ratio_to_largest,
) -> float | None:
    """The distance (m) inside the limits (S,) up to which readings (S, B) form a peak; None without a peak.

    `inside` is the side of the usable readings: −1 below a limit, 1 above. A peak is one value, within a
    millimetre, with `peak_ratio` times the mean count of the values inside it and `ratio_to_largest` times
    the largest of these counts. Readings of a wall spread over several values.
    """
    options = RangeLimitOptions()
    slack = ROUNDING * float(limits.max())
    outer, inner = (limits - inside * slack)[:, None], (limits + inside * options.compared_range)[:, None]
    low, high = np.minimum(outer, inner), np.maximum(outer, inner)
    near = (ranges > np.maximum(low, 0).astype(np.float32)) & (ranges <= high.astype(np.float32))
    rows = np.nonzero(near)[0]
    gaps = inside * (ranges[near].astype(np.float64) - limits[rows])
    at = gaps <= options.peak_distance
    count = np.count_nonzero(at)
    if count < options.peak_readings:
        return None
    _, others = np.unique(np.rint(gaps[~at] * 1000), return_counts=True)
    if others.size and count < max(options.peak_ratio * others.mean(), ratio_to_largest * others.max()):
        return None
    values, counts = np.unique(np.round(gaps[at], 5), return_counts=True)
    if 2 * counts.max() < count:
        return None
    at_peak = gaps[at][np.abs(gaps[at] - values[counts.argmax()]) <= slack + 1e-5]
    return float(at_peak.max())
