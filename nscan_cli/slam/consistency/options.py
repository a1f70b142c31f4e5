"""The parameters of mapping a drive again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class VerificationOptions:
    """Over which ways maps of the same drive are compared, and where they are not."""

    ways: tuple[float, ...] = (1.0, 5.0, 20.0)
    """Lengths of the path over which relative positions are compared, m. Over longer ones small errors of
    heading count more."""
    least_move: float = 0.1
    """The way is measured in pieces of at least this length, m. A smaller value counts the noise of a
    standing robot as way."""
    max_step: float = 0.3
    """A way is left out if a repeated map has two successive scans on it that are farther apart, m: with
    every second scan it may be lost there. A larger value compares more."""
    max_turn: float = 0.26
    """A way is also left out if two successive scans on it are turned against each other by more, rad. A
    larger value compares more."""
    start: float = 0.3
    """Without odometry a robot that begins in a bare corridor seems to stand at first. The comparison begins
    where the repeated map is this far from its start, m. A larger value compares less."""
    compared_move: float = 0.3
    """Scans so far apart on the path, m, tell whether a repeat without odometry is wrong. A smaller value
    compares more of them."""
    compared_turn: float = 0.3
    """Or turned so far against each other, rad."""
    compared: int = 3
    """Each scan is compared with so many of these before and behind it. More take longer."""
    different_step: float = 0.02
    """Two scans are compared if their relative poses on both paths differ by more than this, m and rad
    together. A smaller value compares more."""
    min_gain: float = 0.1
    """A scan contradicts a repeat if the mean energy of its points, from -1 to -3 where they fit, is higher
    there than on the path by more than this. A larger value counts more repeats."""
    max_difference: float = 0.3
    """Largest difference of two maps without a warning, m. It is below 0.2 m on sound logs. A larger value
    warns less."""
    bound: float | None = None
    """Largest difference without a failure, m; None: no difference is one. A larger value fails less."""
