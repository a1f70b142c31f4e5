"""The options of reading which ranges are distances, and which value means "no return"."""

from __future__ import annotations

from dataclasses import dataclass


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
