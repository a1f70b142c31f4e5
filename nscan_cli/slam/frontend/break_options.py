"""The parameters of breaks: when two views are the same, and when the robot was carried."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class ViewSimilarityOptions(NamedTuple):
    """When two scans from nearly the same place see the same."""

    sectors: int = 180
    """Number of sectors of the view; in each, the nearest points of both scans are compared. More are finer
    and have fewer points."""
    min_sectors: int = 10
    """Least number of sectors in which both scans have points. A larger number compares fewer scans."""
    tolerance: float = 0.2
    """Largest difference of two equal ranges, m. A larger value takes more views for the same."""
    tolerance_per_metre: float = 0.1
    """Growth of the tolerance with the shorter range, m/m. A larger value takes more views for the same."""


@dataclass(frozen=True)
class BreakOptions:
    """When the track is broken: the robot was carried, and a new segment of the track begins."""

    poor_inliers: float = 0.7
    """A match with a smaller share of inliers is poor: its view is compared with that of the scan before. A
    larger value compares more."""
    view: ViewSimilarityOptions = field(default_factory=ViewSimilarityOptions)
    """When the views of two scans are the same."""
    min_similarity: float = 0.7
    """A poor match is doubted if the two views are the same in a smaller share of sectors. A larger value
    breaks more often."""
    max_doubted: int = 5
    """Number of scans that may follow a doubted one before the track breaks: someone may stand in the way. It
    does not break if one of them sees again what was seen before. A larger number breaks less often."""
    usual_scans: int = 30
    """Number of scans whose median share of inliers is the usual one. More follow changes more slowly."""
    min_usual_inliers: float = 0.8
    """The track breaks only if the usual share is at least this: with a smaller one scans do not see clearly.
    A larger value breaks less often."""
    min_inlier_drop: float = 0.37
    """The first doubted scan has a share of inliers lower than the usual one by at least this. A larger value
    breaks less often: in sparse surroundings matches are poor now and then, and odometry goes on."""
    stood: float = 0.05
    """Odometry stood if its step is smaller, m and rad. A larger value breaks more often."""
    carried_similarity: float = 0.4
    """The track also breaks where odometry stood, the scan before fitted better by `min_inlier_drop`, and the
    two views are the same in a smaller share of sectors, also where scans do not see clearly. A larger value
    breaks more often."""
    driven: float = 0.3
    """So the track breaks only once odometry has driven this far, m: people about a robot that stands go
    away. A larger value breaks less often."""
    max_standing: int = 200
    """Most scans that wait for that. A larger number takes more memory."""
    bridged_distance: float = 2.0
    """A segment that begins farther away by odometry is no break, m: other things are in view there, and
    odometry bridges the way. A larger value breaks more often."""
    bridged_turn: float = 1.0
    """A segment that begins turned farther than this by odometry is no break either, rad. A larger value
    breaks more often."""
    path: float = 40.0
    """Length of path that a break counts as, m: the keyframes before it are of another visit. A larger value
    separates longer visits."""
    distance_sigma: float = 100.0
    """Standard deviation of the relation over a break, m. A larger value searches farther."""
    turn_sigma: float = 1.8
    """Standard deviation of the turn over a break, rad: all angles are about equally likely. A larger value
    makes them more alike."""
