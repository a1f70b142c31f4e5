"""Usual sizes of rooms and speeds of robots: they tell whose metre is wrong, that of odometry or of ranges.

Scans and odometry only tell the factor between both.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class ExpectedSizes(NamedTuple):
    """What is expected of a robot that drives indoors."""

    median_range: float = 3.0
    """Median range, m. A larger value takes ranges for too short more often."""
    speed: float = 0.5
    """Speed, m/s. A larger value takes odometry for too short more often."""


def ranges_over_odometry(median_range: float, speed: float, scale: float, expected: ExpectedSizes) -> float:
    """How much likelier it is, as a factor, that ranges are in a unit of `scale` (m) than that odometry is
    too long by it in its unit: as if what is so many times off were so many times less likely.

    `median_range` (m) and `speed` (m/s) are those of the file.
    """
    ranges = _off(median_range * scale, expected.median_range) + _off(speed, expected.speed)
    odometry = _off(median_range, expected.median_range) + _off(speed / scale, expected.speed)
    return math.exp(odometry - ranges)


def _off(value: float, expected: float) -> float:
    return abs(math.log(value / expected))
