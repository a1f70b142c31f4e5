"""Readings that pile up at one value: what a driver writes for something else than a distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array

MIN_PEAK_READINGS = 20
"""So many readings are no chance."""
AT = 0.0015
"""m; so near to a limit are readings that are written for it: most lasers count millimetres."""
ROUNDING = 2e-6
"""Of a limit; more than 32 bits make."""
BESIDE = 1.0
"""m; how far inside a limit the readings are that those at it are compared with."""
USUALLY = 10.0
"""Times as many readings as others near by have."""


def peak_at_limit(
    ranges: NDArray[np.float32], limits: Array, inside: int, times: float = 2.0
) -> float | None:
    """How far (m) inside of the limits (S,) readings (S, B) lie that pile up there; None where none do.

    `inside` is where readings count: −1 before a limit, 1 beyond. A pile is one value of a millimetre that
    has ten times the readings that others near by have, and `times` those of any; a wall is spread over
    several.
    """
    slack = ROUNDING * float(limits.max())
    outer, inner = (limits - inside * slack)[:, None], (limits + inside * BESIDE)[:, None]
    low, high = np.minimum(outer, inner), np.maximum(outer, inner)
    near = (ranges > np.maximum(low, 0).astype(np.float32)) & (ranges <= high.astype(np.float32))
    rows = np.nonzero(near)[0]
    gaps = inside * (ranges[near].astype(np.float64) - limits[rows])
    at = gaps <= AT
    count = np.count_nonzero(at)
    if count < MIN_PEAK_READINGS:
        return None
    _, others = np.unique(np.rint(gaps[~at] * 1000), return_counts=True)
    if others.size and count < max(USUALLY * others.mean(), times * others.max()):
        return None
    values, counts = np.unique(np.round(gaps[at], 5), return_counts=True)
    if 2 * counts.max() < count:
        return None
    usual = gaps[at][np.abs(gaps[at] - values[counts.argmax()]) <= slack + 1e-5]
    return float(usual.max())
