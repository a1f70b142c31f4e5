"""The parameters of joint matching."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from nscan_cli.matching.joint.gauge import gauge_of
from nscan_cli.matching.search_options import SearchOptions


@dataclass(frozen=True)
class IndexSetOptions:
    """Which pairs of scans are matched with each other."""

    beam_angle: float = 0.05
    """Greatest angle between a position and the nearest beam at which the scan saw the position, rad. Beams
    of a laser with 180 of them are 0.017 apart. A larger value makes more pairs `visible`."""
    visible_distance: float = 0.3
    """A position nearer to the robot than this was seen in any case, m. A larger value makes more pairs
    `visible`."""
    least_share: float = 0.15
    """Least share of a scan's points in cells where the other has a Gaussian. A larger value leaves out pairs
    with little in common. With 0.25 more problems of ten scans from odometry are solved, but pairs that tie
    all scans together are lost, as in the paper's Fig. 3."""
    stride: int = 3
    """One point of so many is looked at. A larger value is faster and less exact."""


@dataclass(frozen=True)
class InitialisationOptions:
    """How scans are placed by search when the start is poor."""

    search: SearchOptions = field(default_factory=SearchOptions)
    """The search for one scan among those that are placed."""
    lever: float = 2.0
    """When placed scans are aligned with their start, a radian of error weighs as much as this distance, m.
    With a larger value angles count more."""
    passes: int = 3
    """Most passes in which every scan is searched again among all others. More take longer."""
    widenings: tuple[float, ...] = (0.3, 1.0)
    """The w of the energy in each stage of a match: it multiplies the information of the Gaussians, so that
    w < 1 widens them. The last w is 1. With larger ones before, matches converge only from nearer. Here
    the match starts from a pose found by search, which is off by about 0.1 m."""


class WallFitOptions(NamedTuple):
    """Which points are walls, and how much a wall says about poses."""

    cell: float = 0.25
    """Side of the smallest cell in which a wall is looked for, m. With a larger one, walls are longer and
    fewer."""
    levels: int = 5
    """Number of cell sizes. Each is twice the next smaller one, and larger ones are looked at first. With a
    larger number longer walls are found."""
    minimum: int = 6
    """Least number of points on a wall. With a larger number fewer walls are found."""
    thickness: float = 0.02
    """Greatest standard deviation of points across a wall, m. It is little more than the noise of ranges. A
    larger value takes rougher things for walls."""
    elongation: float = 10.0
    """Least ratio of a wall's variance along itself to the variance across. A larger value leaves out short
    walls."""
    range_sigma: float = 0.02
    """Standard deviation of a range along its beam, m. A larger value makes beams that hit a wall head-on
    count less than those that graze it."""
    wall_sigma: float = 0.005
    """Standard deviation of a wall from a straight line, m. With a larger value walls hold the poses less."""
    prior_share: float = 0.2
    """Share of the match's Hessian that holds the poses where no wall does. A larger share keeps poses nearer
    to the match."""
    direction_noise: float = 10.0
    """Noise in the direction of a wall seems to tell something of motion along the wall. Poses are held along
    it by this factor more than that. A larger value holds them more."""
    steps: int = 2
    """Number of Gauss–Newton steps. The problem is nearly linear, so more of them change little."""


@dataclass(frozen=True)
class AmbiguityOptions:
    """How a joint match is checked for other places where its scans fit."""

    least_sigma: float = 0.015
    """Motions with a smaller standard deviation are not checked, m. With this value none is in rooms. A
    larger one checks fewer."""
    greatest_sigma: float = 1.0
    """Motions with a larger standard deviation are not checked, m, since the Hessian itself tells that they
    are uncertain. A larger value checks more."""
    motions: int = 3
    """Most motions that are checked, the least certain ones. More take longer."""
    distance: float = 1.9
    """Greatest distance along a motion, to both sides, at which the energy is compared, m. With a larger
    value, places farther away count."""
    places: int = 10
    """Number of places to each side where the energy is compared. They are denser near the match. More take
    longer and are more exact."""
    spread: float = 1.5
    """Exponent by which the distances of these places grow. With a larger value they are denser near the
    match, and sparser far from it."""
    stride: int = 4
    """One point of so many is compared. A larger value is faster and less exact."""
    correlation: float = 3.0
    """Energies are divided by this, since neighbouring beams err together. A larger value makes a match less
    certain."""


class DescentSettings(NamedTuple):
    """The fields of JointOptions that the kernel of a descent takes."""

    stride: int
    """One point of so many is matched. A larger value is faster and less exact."""
    fixed: int
    """As `gauge_of` returns it."""
    iterations: int
    """Most iterations in a stage."""
    thorough: bool
    """Whether energy and derivatives are evaluated after the last step too, rather than before it."""
    stretched: bool
    """As in JointOptions."""


@dataclass(frozen=True)
class JointOptions:
    """How a joint match is minimised, and what its result has to satisfy."""

    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """The w of the energy in each stage of a match: it multiplies the information of the Gaussians, so that
    w < 1 widens them. The last w is 1. With larger ones before, matches converge only from nearer. Here
    they are those of the approach; after it come steps with w = 1, too."""
    near: float = 0.01
    """A stage of the approach with w < 1 ends when no pose moves by more, m and rad. That with w = 1 ends at
    half of it. A larger value ends them earlier."""
    stride: int = 2
    """On the approach one point of so many is matched. A larger value is faster and less exact."""
    approach_iterations: int = 30
    """Most iterations in each stage of the approach. A larger number lets slow matches converge."""
    max_iterations: int = 30
    """Most iterations in the last stage. A larger number lets slow matches converge."""
    tolerance: float = 1e-4
    """The match has converged when no pose moves by more, m and rad. A larger value ends it earlier."""
    thorough: bool = True
    """Whether energy and derivatives are evaluated after the last step too, rather than before it."""
    stretched: bool = False
    """Whether slow descents take longer steps. They also bring scans together that do not belong together, so
    not where a loop is to be found."""
    fixed: int | None = None
    """The scan that stays where it is; None leaves the gauge free (paper, III-D)."""
    inlier_bound: float = 9.0
    """A point lies on a Gaussian within this squared Mahalanobis distance. A larger value counts more
    points."""
    least_overlap: float = 0.1
    """A scan with a smaller share of points on every other scan is an outlier. A larger value makes more
    outliers."""
    sound_overlap: float = 0.5
    """Overlaps of at least this connect scans that lie where they belong. If they do not connect all scans,
    these are placed by search. A larger value searches more often."""
    overlap_reward: float = 0.78
    """Where overlap is to count, a point lowers the neutral energy if its s exceeds this share of the usual
    s. With 1 overlap counts for nothing. A smaller value pulls scans over each other."""
    prior_share: float = 0.05
    """The scans leave a direction open if priors have a larger share of its information. Along a corridor
    without doors that is mostly a quarter or more, across it 0.0002 or less. A larger value leaves fewer
    directions open."""
    outlier_probability: float = 0.001
    """A scan is an outlier if its priors give its χ² (3 degrees of freedom) a smaller probability. A larger
    value makes more outliers."""
    index_set: IndexSetOptions = field(default_factory=IndexSetOptions)
    """Which pairs of scans are matched with each other."""
    initialisation: InitialisationOptions = field(default_factory=InitialisationOptions)
    """How scans are placed by search when the start is poor."""
    wall_fit: WallFitOptions = field(default_factory=WallFitOptions)
    """How the poses are fitted to walls after the match."""

    @property
    def approach(self) -> DescentSettings:
        """What the stages of an approach take of these."""
        return DescentSettings(
            self.stride, gauge_of(self.fixed), self.approach_iterations, self.thorough, self.stretched
        )

    @property
    def last_stage(self) -> DescentSettings:
        """What the last stage takes of these."""
        return DescentSettings(1, gauge_of(self.fixed), self.max_iterations, self.thorough, self.stretched)
