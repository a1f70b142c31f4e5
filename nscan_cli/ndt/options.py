"""How points become Gaussians, in the map of tracking and in keyframes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class GaussianOptions:
    """The parameters of an NDT."""

    cell: float = 0.5
    """Side of a cell, m. Larger cells lead a match from farther away, and describe walls more coarsely."""
    minimum: int = 5
    """Least number of points that make a Gaussian. A larger number leaves out thin and rarely hit things."""
    floor: float = 0.02
    """Least standard deviation of a Gaussian, m. A larger value makes walls softer."""
