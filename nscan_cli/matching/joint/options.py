"""The parameters of joint matching."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from nscan_cli.matching.correlative_search import SearchOptions
from nscan_cli.matching.joint.gauge import gauge_of


@dataclass(frozen=True)
class IndexSetOptions:
    """Which pairs of scans are matched with each other."""

    beam_angle: float = 0.05
    """Greatest angle between a position and the nearest beam at which the scan saw the position, rad. Beams
    of a laser with 180 of them are 0.017 apart. A larger value makes more pairs `visible`."""
    visible_distance: float = 0.3
    """A position nearer to the robot than this was seen in any case, m."""
    least_share: float = 0.15
    """Least share of a scan's points in cells where the other has a Gaussian. A larger value leaves out pairs
    with little in common. Of problems of ten scans from odometry more are solved with 0.25, but pairs that
    tie all scans together, as in the paper's Fig. 3, are lost."""
    stride: int = 3
    """One point of so many is looked at. A larger value is faster and less exact."""


@dataclass(frozen=True)
class InitialisationOptions:
    """How scans are placed by search when the start is poor."""

    search: SearchOptions = field(default_factory=SearchOptions)
    """The search for one scan among those that are placed."""
    lever: float = 2.0
    """A radian of error weighs as much as this distance (m) when placed scans are aligned with their
    start."""
    sweeps: int = 3
    """Most times that every scan is searched again among all others. More take longer."""
    widenings: tuple[float, ...] = (0.3, 1.0)
    """Stages of the match that refines a pose found by search, which is off by about 0.1 m."""


class WallFitOptions(NamedTuple):
    """Which points are walls, and how much a wall says about poses."""

    cell: float = 0.25
    """Side of the smallest cell in which a wall is looked for, m."""
    levels: int = 5
    """Number of cell sizes. Each is twice the next smaller one, and larger ones are looked at first."""
    minimum: int = 6
    """Least number of points on a wall."""
    thickness: float = 0.02
    """Greatest standard deviation of points across a wall, m: the noise of ranges, and little more. A larger
    value takes rougher things for walls."""
    elongation: float = 10.0
    """Least ratio of a wall's variance along itself to the variance across."""
    range_sigma: float = 0.02
    """Standard deviation of a range along its beam, m. A larger value makes beams that hit a wall head-on
    count less than those that graze it."""
    wall_sigma: float = 0.005
    """Standard deviation of a wall from a straight line, m."""
    prior_share: float = 0.2
    """Share of the match's Hessian that holds the poses where no wall does."""
    direction_noise: float = 10.0
    """Factor by which poses are held along a wall beyond what noise in the wall's direction seems to tell
    about this motion."""
    steps: int = 2
    """Number of Gauss–Newton steps. The problem is nearly linear."""


@dataclass(frozen=True)
class AmbiguityOptions:
    """How a joint match is checked for other places where its scans fit."""

    least_sigma: float = 0.015
    """Motions with a smaller standard deviation are not checked, m. In rooms no motion is."""
    greatest_sigma: float = 1.0
    """Motions with a larger standard deviation are not checked, m. The Hessian itself tells enough of
    them."""
    motions: int = 3
    """Most motions that are checked, the least certain ones. More take longer."""
    distance: float = 1.9
    """Greatest distance along a motion, to both sides, at which the energy is compared, m."""
    places: int = 10
    """Places to each side where the energy is compared; they are denser near the match."""
    stride: int = 4
    """One point of so many is compared. A larger value is faster and less exact."""
    correlation: float = 3.0
    """Factor by which energies are divided, since neighbouring beams err together. A larger value makes a
    match less certain."""


@dataclass(frozen=True)
class JointOptions:
    """How a joint match is minimised, and what its result has to satisfy."""

    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """Stages of the approach: w of the energy. The last steps are done with 1, the energy itself. Smaller
    first values converge from farther away."""
    near: float = 0.01
    """A wide stage ends when no pose moves by more, m and rad; the stage of w = 1 at half of that."""
    stride: int = 2
    """On the approach one point of so many is matched. A larger value is faster and less exact."""
    approach_iterations: int = 30
    """Most iterations in each stage of the approach."""
    max_iterations: int = 30
    """Most iterations in the last stage."""
    tolerance: float = 1e-4
    """The match has converged when no pose moves by more, m and rad."""
    thorough: bool = True
    """Whether energy and derivatives are evaluated after the last step too, rather than before it."""
    fixed: int | None = None
    """The scan that stays where it is; None leaves the gauge free (paper, III-D)."""
    inlier_bound: float = 9.0
    """Squared Mahalanobis distance from a Gaussian within which a point lies on it."""
    least_overlap: float = 0.1
    """A scan with a smaller share of points on every other scan is an outlier."""
    sound_overlap: float = 0.5
    """Overlap that connects scans which lie where they belong. With less, the scans are placed by search."""
    overlap_reward: float = 0.78
    """Share of the usual s that a point must exceed to lower the neutral energy where overlap is to count.
    With 1 overlap counts for nothing; a smaller value pulls scans over each other."""
    prior_share: float = 0.05
    """Share of information from priors above which the scans leave a direction open. Along a corridor without
    doors it is mostly a quarter or more, across it 0.0002 or less."""
    outlier_probability: float = 0.001
    """A scan is an outlier where its priors give its χ² (3 degrees of freedom) a smaller probability."""
    index_set: IndexSetOptions = field(default_factory=IndexSetOptions)
    initialisation: InitialisationOptions = field(default_factory=InitialisationOptions)
    wall_fit: WallFitOptions = field(default_factory=WallFitOptions)

    @property
    def of_approach(self) -> tuple[int, int, int, float, bool]:
        """Stride, gauge, iterations, near and thorough, as the kernels take them."""
        return self.stride, gauge_of(self.fixed), self.approach_iterations, self.near, self.thorough
