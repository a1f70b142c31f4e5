"""Peaks of readings at one value, which a driver writes for something other than a distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.range_limit_options import RangeLimitOptions
from nscan_cli.poses import Array

ROUNDING = 2e-6
"""Relative rounding error of a limit; that of 32 bits is smaller."""


def peak_at_limit(
    ranges: NDArray[np.float32],
    limits: Array,
    inside: int,
    ratio_to_largest: float | None = None,
    options: RangeLimitOptions = RangeLimitOptions(),
) -> float | None:
    """The distance (m) inside the limits (S,) up to which readings (S, B) form a peak; None without a peak.

    `inside` is the side of the usable readings: −1 below a limit, 1 above. A peak is one value, within a
    millimetre, with `peak_ratio` times the mean count of the values inside it and `ratio_to_largest` (None:
    that of the options) times the largest of these counts. Readings of a wall spread over several values.
    """
    if ratio_to_largest is None:
        ratio_to_largest = options.peak_ratio_to_largest
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
