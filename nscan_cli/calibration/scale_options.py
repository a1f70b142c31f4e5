"""The parameters of comparing lengths by odometry and by scans over parts of a log."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OdometryUnitOptions:
    """When odometry counts in another unit over a part of the log."""

    too_fast: float = 15.0
    """No robot that maps drives faster, m/s. A larger value finds less."""
    still: float = 0.01
    """A robot that is slower by odometry tells nothing, m/s. A larger value counts fewer steps."""
    min_steps: int = 20
    """Least number of steps from scan to scan that are too fast, and of others with motion. A larger value
    finds less."""
    measured_steps: int = 12
    """Number of steps of both kinds that are measured, spread over the log. More tell more and take
    longer."""
    min_measured: int = 4
    """Least number of these steps, of both kinds, that the scans measure. A larger value finds less."""
    tolerance: float = 0.2
    """Odometry has changed from metres to another unit if one metre by it is one by scans, and then one of
    that unit, to within this share. A larger value finds more."""
