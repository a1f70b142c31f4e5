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
class DegenerateStretchOptions:
    """When a way without odometry is held by steady motion alone, since its walls look alike all along."""

    sigma: float = 0.15
    """Standard deviation beyond which a scan does not tell its place along the walls, m. A larger value warns
    less."""
    path: float = 2.0
    """Least length of such a way that a warning names, m, as mapped or at the robot's usual speed. As mapped
    it is 2.5 m and more in bare corridors, at most 0.7 m elsewhere. A larger value warns less."""
    scans_between: int = 2
    """Largest number of successive scans within it that seem to tell their place. A larger number joins more
    ways."""
    least_speed: float = 0.05
    """A slower robot stands, m/s. A larger value makes the usual speed that of fast drives."""
    max_lost_share: float = 0.5
    """If more of the scans than this share fit nothing that was seen before, that is named in place of the
    ways. A larger value names ways more often."""


@dataclass(frozen=True)
class DiagnosticsOptions:
    """From where on the notices of a graph warn."""

    odometry: OdometryDisagreementOptions = field(default_factory=OdometryDisagreementOptions)
    view: ViewMismatchOptions = field(default_factory=ViewMismatchOptions)
    degenerate_stretch: DegenerateStretchOptions = field(default_factory=DegenerateStretchOptions)
    gap_periods: float = 3.0
    """Scans are missing if the next one comes later than this multiple of the median period. A larger value
    warns less."""
    max_mean_chi2: float = 3.0
    """Largest mean χ² of all relations, with three degrees of freedom. It is below 1 on sound logs. A larger
    value warns less."""
    max_mean_loop_chi2: float = 6.0
    """Largest mean χ² of loops, which join what has drifted. A larger value warns less."""
