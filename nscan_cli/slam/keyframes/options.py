"""The parameters of keyframes and of the relations between them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class KeyframeOptions:
    """Step 2: which scans become keyframes, and how well tracking knows the way between two."""

    distance: float = 1.75
    """A scan farther than this (m) from the last keyframe becomes one. A larger distance makes a smaller
    graph, whose scans overlap less."""
    distance_per_range: float = 0.3
    """The distance is at least this share of the median range: a laser that sees farther sees the same for
    longer. A larger share makes a smaller graph."""
    turn: float = 0.8
    """A scan turned by more than this against the last keyframe becomes one, rad. A larger value makes a
    smaller graph."""
    slip_sigmas: float = 1.5
    """A scan may have slipped if it is off the odometry by more standard deviations than this, and
    `slip_inlier_drop` holds as well. A larger value finds fewer slips."""
    slip_inlier_drop: float = 0.05
    """A scan may have slipped if its share of inliers is lower by more than this than before. A larger value
    finds fewer slips."""
    slip_factor: float = 2.0
    """A scan that may have slipped becomes a keyframe only beyond this multiple of `distance` and `turn`. A
    larger value avoids such keyframes more."""
    information_scale: float = 0.8
    """Factor of tracking's Hessian as the information of a relation: neighbouring scans make the same errors.
    A larger value trusts tracking more."""
    drift: float = 0.0025
    """Standard deviation of the chain that no match shows, m/√m. A larger value lets loops move the path
    more."""
    drift_angle: float = 0.001
    """Standard deviation of the heading along the chain that no match shows, rad/√m. A larger value lets
    loops turn the path more."""
    drift_min_path: float = 0.01
    """Length added to the path between two keyframes for the drift, m: no relation is exact. A larger value
    lets loops move the path more."""
