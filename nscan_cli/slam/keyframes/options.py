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
    """The distance is at least this share of the median range: who sees farther sees the same for longer."""
    turn: float = 0.8
    """A scan turned by more than this (rad) against the last keyframe becomes one."""
    slip_sigmas: float = 1.5
    """A scan may have slipped if it is off the odometry by more standard deviations than this
    and `slip_inlier_drop` says so as well."""
    slip_inlier_drop: float = 0.05
    """A scan may have slipped if its share of inliers is lower by more than this than before."""
    slip_factor: float = 2.0
    """A scan that may have slipped needs `distance` and `turn` times this to become a keyframe."""
    information_scale: float = 0.8
    """Weight of tracking's Hessian as information of a relation: neighbouring scans make the same errors."""
    drift: float = 0.0025
    """Standard deviation that no match shows, m/√m. Larger drift lets loops move the path more."""
    drift_angle: float = 0.001
    """The same of the angle, rad/√m."""
    drift_min_path: float = 0.01
    """Length that is added to the path between two keyframes for the drift, m: no relation is exact."""
