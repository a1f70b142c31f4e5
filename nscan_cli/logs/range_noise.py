"""The noise of ranges, by beams beside each other: where it is large, a map cannot be exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array

QUARTILE = 0.31864
"""A quarter of the values of a standard normal distribution are within this distance of 0."""


@dataclass(frozen=True)
class RangeNoiseOptions:
    """When it is said that ranges are noisy."""

    min_noise: float = 0.07
    """Least standard deviation that is named, m. It is 0.035 at most on real logs. A larger value names fewer
    logs."""
    min_share: float = 0.01
    """Least share of the median range that it is: far walls outdoors look rough. A larger value names fewer
    logs."""
    max_ratio: float = 1.5
    """Three beams see one wall if no range is more than this multiple of another. A larger value also takes
    corners of things for walls."""
    min_triples: int = 1_000
    """Least number of such beams that tell. A larger value names fewer logs."""
    sample: int = 20_000
    """Approximate number of ranges that are looked at. More take longer."""


def noise_of_ranges(ranges: NDArray[np.float32], angle_increment: Array) -> str:
    """The message if ranges (S, B), m, are noisy; else empty. nan and inf do not count.

    `angle_increment` (S,) is the angle between beams, rad. Along a straight wall 1/r is a sinusoid of the
    angle, of which three values tell each other: 1/r₋ + 1/r₊ = 2 cos(δ)/r. What r is off that has the
    variance of six ranges. Edges are far off, so that the quarter that is least off tells.
    """
    options = RangeNoiseOptions()
    stride = max(ranges.size // options.sample, 1)
    some = ranges[::stride].astype(np.float64)
    before, middle, after = some[:, :-2], some[:, 1:-1], some[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        far, near = np.maximum(before, after), np.minimum(before, after)
        is_wall = (np.maximum(far, middle) < options.max_ratio * np.minimum(near, middle)) & (near > 0.0)
        is_wall &= np.isfinite(before + middle + after)
        off = (
            middle * (middle / before + middle / after)
            - 2.0 * np.cos(angle_increment[::stride])[:, None] * middle
        )
    off, usual = np.abs(off[is_wall]), middle[is_wall]
    if len(off) < options.min_triples:
        return ""
    noise = float(np.quantile(off, 0.25)) / (QUARTILE * np.sqrt(6.0))
    if noise < max(options.min_noise, options.min_share * float(np.median(usual))):
        return ""
    return (
        f"ranges of beams beside each other scatter by {noise:.2g} m, those of most lasers by 0.01 to 0.03: "
        "walls are blurred, and where only small things tell the way the map is less exact"
    )
