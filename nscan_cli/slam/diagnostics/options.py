"""The parameters of the diagnostics: when a user is warned. None changes a graph."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class OdometryDisagreementOptions:
    """When odometry and scans disagree about the distance that the robot came."""

    path: float = 5.0
    """Length of path over which both distances are compared, m. Over a smaller one noise counts too much."""
    max_share: float = 0.4
    """Largest difference of the distances, as a share of the path. For sound odometry it is little more than
    half of this, with disturbed steps too. A larger value warns less."""
    stood: float = 0.05
    """Odometry stands if its step is smaller, m and rad. A larger value warns more."""
    carried: float = 0.5
    """The robot is carried if it moves farther than this meanwhile, m or rad. A larger value warns less."""


@dataclass(frozen=True)
class ViewMismatchOptions:
    """When scans see other things than the keyframe before them."""

    scans: int = 10
    """Number of scans that are judged together: someone who comes close hides the view for a moment. A larger
    number warns less."""
    min_similarity: float = 0.28
    """Least mean share of sectors with the same view. It is 0.53 or more in four real buildings, 0.29
    outdoors, and 0.02 to 0.27 where someone walks along. A larger value warns more."""


@dataclass(frozen=True)
class DiagnosticsOptions:
    """From where on the notices of a graph warn."""

    odometry: OdometryDisagreementOptions = field(default_factory=OdometryDisagreementOptions)
    """When odometry and scans disagree about distances."""
    view: ViewMismatchOptions = field(default_factory=ViewMismatchOptions)
    """When scans see other things than the keyframe before them."""
    max_lost_share: float = 0.5
    """If more of the scans than this share fit nothing that was seen before, a warning says so in place of
    the ways that no scan tells. A larger value names such ways more often."""
    guessed_way: float = 1.5
    """Least length of a way that no scan tells, without odometry, m. In offices it is a metre at most, as
    mapped or at the robot's usual speed. A larger value warns less."""
    gap_periods: float = 3.0
    """Scans are missing if the next one comes later than this multiple of the median period. A larger value
    warns less."""
    max_mean_loop_chi2: float = 6.0
    """Largest mean χ² of loops, which join what has drifted. A larger value warns less."""
