"""Ranges that were rounded coarsely before they were recorded: a map cannot be more exact than they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class RoundedRangeOptions:
    """When it is said that ranges were rounded."""

    min_step: float = 0.08
    """Least step between the values of ranges that is named, m. Steps of 0.05 m hardly change a map. A larger
    value names fewer logs."""
    tolerance: float = 1e-3
    """Largest distance of a range from a multiple of the step, m. A larger value names more logs."""
    min_share: float = 0.99
    """Least share of the ranges that are multiples. A larger value names fewer logs."""
    min_returns: int = 1_000
    """Least number of ranges that tell. A larger value names fewer logs."""
    min_values: int = 5
    """Least number of different ranges: a few walls tell no step. A larger value names fewer logs."""
    sample: int = 20_000
    """Approximate number of ranges that are looked at. More take longer."""


def rounding_of_ranges(ranges: NDArray[np.float32]) -> str:
    """The message if ranges (S, B), m, are multiples of a step; else empty. nan and inf do not count."""
    options = RoundedRangeOptions()
    some = ranges[:: max(ranges.size // options.sample, 1)].astype(np.float64).ravel()
    some = some[np.isfinite(some)]
    if len(some) < options.min_returns:
        return ""
    values, counts = np.unique(np.round(some / options.tolerance), return_counts=True)
    # Single values may be of another kind.
    values = values[counts > (1.0 - options.min_share) * len(some) / options.min_values]
    if len(values) < options.min_values:
        return ""
    step = options.tolerance * float(np.median(np.diff(values)))
    off = np.abs(some - step * np.round(some / step))
    if step < options.min_step or (off <= options.tolerance).mean() < options.min_share:
        return ""
    return (
        f"the ranges are multiples of {step:.3g} m: they were rounded before they were recorded, and the map "
        "is less exact for it; no option gives back what was lost"
    )
