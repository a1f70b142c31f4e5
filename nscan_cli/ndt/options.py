"""How points become Gaussians, in the map of tracking and in keyframes."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class WallOptions:
    """How the Gaussian of a piece of wall gets its side, its direction and its ends."""

    max_neighbour: int = 10
    """The surface at a point is seen from its neighbours in the scan, at most so many points to each side. A
    larger number finds more of them where the robot is close to a wall."""
    min_spacing: float = 0.1
    """Neighbours that are nearer than this are passed over, since they differ by noise, m. A larger value is
    less noisy, and rounds corners."""
    max_spacing: float = 0.5
    """Neighbours that are farther than this belong to something else, m. A larger value takes more for one
    surface."""
    min_side_share: float = 0.2
    """A wall was seen from one side if the unit vectors along the beams have a mean component of more than
    this across it. A larger value leaves the side open more often."""
    min_elongation: float = 10.0
    """Least ratio of the larger to the smaller variance of a piece of wall. With a larger value fewer pieces
    get the direction of their neighbourhood."""
    min_cosine: float = 0.9
    """Least cosine of twice the angle between the directions of a piece of wall and of its neighbourhood.
    With a larger value only smaller differences are corrected."""
    end_share: float = 0.75
    """A wall ends in a cell if it is shorter than this share of the cell's side. With a larger value more
    pieces count as ends, which hold nothing along the wall."""
    max_end_ratio: float = 1.5
    """Greatest ratio of the variance across the end of a wall to that of its neighbourhood. A corner has
    more. With a larger value corners count as ends, too."""


@dataclass(frozen=True)
class GaussianOptions:
    """The parameters of an NDT."""

    cell: float = 0.5
    """Side of a cell, m. Larger cells lead a match from farther away, and describe walls more coarsely."""
    minimum: int = 5
    """Least number of points that make a Gaussian. A larger number leaves out thin and rarely hit things."""
    floor: float = 0.02
    """Least standard deviation of a Gaussian, m. A larger value makes walls softer."""
    least_ratio: float = 0.001
    """Least ratio of the smaller to the larger variance of a Gaussian ([19]). A larger value makes long walls
    softer."""
    walls: WallOptions = field(default_factory=WallOptions)
    """How the Gaussians of walls get their sides, directions and ends."""
