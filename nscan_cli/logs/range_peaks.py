"""Peaks of readings at one value, which a driver writes for something other than a distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array

MIN_PEAK_READINGS = 20
"""Smallest number of readings of a peak. A larger value finds fewer peaks."""
PEAK_DISTANCE = 0.0015
"""Largest distance of a peak from the limit, m. Most lasers count millimetres."""
ROUNDING = 2e-6
"""Relative rounding error of a limit; that of 32 bits is smaller."""
COMPARED_RANGE = 1.0
"""Readings inside the limit up to this distance from it are compared with the peak, m."""
MIN_RATIO_TO_MEAN = 10.0
"""Smallest ratio of a peak to the mean count per millimetre of the readings compared with it."""


def peak_at_limit(
    ranges: NDArray[np.float32], limits: Array, inside: int, ratio_to_largest: float = 2.0
) -> float | None:
    """The distance (m) inside the limits (S,) up to which readings (S, B) form a peak; None without a peak.

    `inside` is the side of the usable readings: −1 below a limit, 1 above. A peak is one value, within a
    millimetre, with 10 times the mean count of the values inside it and `ratio_to_largest` times the largest
    of these counts. Readings of a wall spread over several values.
    """
    slack = ROUNDING * float(limits.max())
    outer, inner = (limits - inside * slack)[:, None], (limits + inside * COMPARED_RANGE)[:, None]
    low, high = np.minimum(outer, inner), np.maximum(outer, inner)
    near = (ranges > np.maximum(low, 0).astype(np.float32)) & (ranges <= high.astype(np.float32))
    rows = np.nonzero(near)[0]
    gaps = inside * (ranges[near].astype(np.float64) - limits[rows])
    at = gaps <= PEAK_DISTANCE
    count = np.count_nonzero(at)
    if count < MIN_PEAK_READINGS:
        return None
    _, others = np.unique(np.rint(gaps[~at] * 1000), return_counts=True)
    if others.size and count < max(MIN_RATIO_TO_MEAN * others.mean(), ratio_to_largest * others.max()):
        return None
    values, counts = np.unique(np.round(gaps[at], 5), return_counts=True)
    if 2 * counts.max() < count:
        return None
    at_peak = gaps[at][np.abs(gaps[at] - values[counts.argmax()]) <= slack + 1e-5]
    return float(at_peak.max())
