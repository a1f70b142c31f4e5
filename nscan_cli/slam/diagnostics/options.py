"""The parameters of the diagnostics: from where on a user is warned. None changes a graph."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class FreeSpaceOptions(NamedTuple):
    """When one visit looks through too much of what another one saw."""

    keyframes: int = 40
    """Keyframes that are judged together. What differs in a sound map is seen from few: the worst ten of
    fr-campus look through 24 % of what was there before, the worst forty 8 %."""
    min_keyframes: int = 3
    """Least number of keyframes at places seen before; with fewer nothing is said."""
    min_points: int = 50
    """Least number of compared points of a keyframe that counts."""
    compared: int = 8
    """Keyframes that each is compared with: the nearest of other visits, and as many of its own."""
    tolerance: float = 0.2
    """A point this much (m) nearer than the shortest of four neighbouring beams is looked through."""
    tolerance_per_metre: float = 0.02
    """Growth of the tolerance with the range, m/m."""
    within_factor: float = 2.5
    """A sound map has at most this multiple of the share that is looked through within visits. It is 0.5 to
    1.6 in real buildings, and 4 to 300 in simulated maps that are metres wrong."""
    margin: float = 0.01
    """Share that is added to that bound."""
    max_share: float = 0.15
    """Largest share in any sound map. It is 0.08 in mit-killian and fr-campus, and 0.26 and more in maps of
    these that are metres wrong."""


@dataclass(frozen=True)
class OdometryDisagreementOptions:
    """When odometry and scans disagree about the distance that the robot came."""

    path: float = 5.0
    """Length of path over which both distances are compared, m. Over less, noise counts too much."""
    max_share: float = 0.4
    """They disagree if the distances differ by more than this share of the path. Sound odometry is off by
    little more than half of it, with disturbed steps too."""


@dataclass(frozen=True)
class ViewMismatchOptions:
    """When scans see other things than the keyframe before them."""

    scans: int = 10
    """Scans that are judged together: someone who comes close hides the view for a moment."""
    min_similarity: float = 0.28
    """Least mean share of sectors with the same view. It is 0.53 or more in four real buildings, 0.29
    outdoors, and 0.02 to 0.27 where someone walks along."""


@dataclass(frozen=True)
class UntoldWayOptions:
    """When a way without odometry is held by steady motion alone, since its walls look alike all along."""

    sigma: float = 0.15
    """Standard deviation (m) beyond which a scan does not tell its place along the walls."""
    path: float = 2.0
    """Least length of such a way that is named, m. It is 2.5 m and more in bare corridors, at most 0.7 m in
    offices and outdoors."""
    scans_between: int = 2
    """Most scans in succession within it that seem to tell more."""


@dataclass(frozen=True)
class DiagnosticsOptions:
    """From where on the notices of a graph warn."""

    free_space: FreeSpaceOptions = field(default_factory=FreeSpaceOptions)
    odometry: OdometryDisagreementOptions = field(default_factory=OdometryDisagreementOptions)
    view: ViewMismatchOptions = field(default_factory=ViewMismatchOptions)
    untold_way: UntoldWayOptions = field(default_factory=UntoldWayOptions)
    gap_periods: float = 3.0
    """Scans are missing when the next one comes later than this multiple of the median period."""
    max_mean_chi2: float = 3.0
    """Largest mean χ² of all relations, with three degrees of freedom. It is below 1 on sound logs."""
    max_mean_loop_chi2: float = 6.0
    """Largest mean χ² of loops: they join what has drifted."""
