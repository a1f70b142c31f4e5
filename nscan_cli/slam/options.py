"""The parameters of the SLAM loop, one set for all logs; what the graph's provenance records."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from nscan_cli.graph.optimise.robust import RobustOptions
from nscan_cli.matching.correlative_search import SearchOptions
from nscan_cli.matching.joint.options import AmbiguityOptions
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.slam.diagnostics.options import DiagnosticsOptions
from nscan_cli.slam.frontend.options import BreakOptions, OdometryCheckOptions, TrackingOptions
from nscan_cli.slam.keyframes.options import KeyframeOptions

Relations = Literal["pairwise", "nscan", "both"]
"""What the graph is made of; see SlamOptions."""


@dataclass(frozen=True)
class NScanOptions:
    """Step 3: the joint match of the scans near a keyframe, or the single matches in its place."""

    gaussians: GaussianOptions = field(default_factory=lambda: GaussianOptions(minimum=4))
    max_scans: int = 10
    radius: float = 5.0
    """How near (m) a keyframe must be to take part."""
    recent: float = 20.0
    """Keyframes further back along the path (m) count as seen before; half of the places go to them,"""
    first_visits: int = 3
    """those of so many visits, the first ones."""
    covered: float = 0.7
    """No match is made about a keyframe when others hold so many of its pairs already."""
    behind: int = 3
    """The centre is so many keyframes behind the newest, so that those on both sides of it are known."""
    loops: bool = True
    """Whether these take part at all; without them the graph keeps the drift of tracking."""
    scale_per_cell: float = 0.3
    """What the energy is multiplied with where a scan has one point in each lattice cell: four Gaussians see
    each point. More points in a cell hit the same piece of wall, and count as much together."""
    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    max_iterations: int = 30
    tolerance: float = 1e-3
    """m, rad"""
    overlap: float = 0.65
    """Share of inliers, one of the other, that holds two scans together."""
    inlier_bound: float = 9.0
    """Squared Mahalanobis distance from a Gaussian within which a point lies on it."""
    ambiguity: AmbiguityOptions = field(default_factory=AmbiguityOptions)
    """How a joint match is checked for other places where its scans fit."""
    settled: float = 0.1
    """When the last stage alone moves a scan further (m), or one is too far off to take part in it, all
    stages are run."""

    @property
    def attempts(self) -> tuple[tuple[float, ...], ...]:
        """The widenings to match with, the next ones when those before did not settle.

        Mostly the poses are right to centimetres already, and the last stage is all it takes.
        """
        last, whole = self.widenings[-1:], self.widenings
        return (last,) if last == whole else (last, whole)


@dataclass(frozen=True)
class ClosingOptions:
    """Step 4: the search for a place seen before, and what its result has to stand."""

    drift: float = 0.05
    """Standard deviation (m/√m) of tracking, slips that it does not know of included."""
    drift_angle: float = 0.002
    """rad/√m"""
    deviations: float = 3.0
    """A keyframe may be off by so many standard deviations."""
    settled: float = 1.0
    """By no more than this (m) a joint match finds the place itself."""
    asked: int = 500
    """The graph is asked how far off a keyframe may be: of a large one the part nearest to it, of so many
    keyframes, with the ways to all that may be searched."""
    step: float = 3.0
    """From one search to the next, m of path."""
    search: SearchOptions = field(default_factory=lambda: SearchOptions(beams=180))
    least: float = 4.0
    """How far a place is searched at least: a slip while all else is well known, m."""
    least_turn: float = 0.2
    """rad"""
    farthest: float = 25.0
    """And at most, m."""
    lost: float = 100.0
    """How far (m) when not even the direction is known: the track has broken."""
    beside: float = 6.0
    """The keyframes of so much path (m) to both sides are searched together."""
    around: float = 15.0
    """Among those of the earlier visit within this distance (m) of where the place may be."""
    score: float = 0.55
    """Least share of the points that must fit."""
    rival: float = 0.88
    """No other place may fit as well as that, relative to the best."""
    apart: float = 1.5
    """What is farther off (m) is another place."""
    agree: float = 0.5
    """How well two keyframes must agree, m."""
    agree_turn: float = 0.05
    """rad"""
    together: float = 30.0
    """And how near each other they must be, m of path."""
    agreeing: int = 2
    """How many keyframes must agree;"""
    agreeing_lost: int = 3
    """when the track has broken, where rooms alike are not told apart by how far they are;"""
    likely: float = 2.5
    """or when they are off by more standard deviations than this,"""
    slip: float = 5.0
    """and by more (m) than tracking slips: then, too, the first and the last of them may share no scans."""


@dataclass(frozen=True)
class GrowthOptions:
    """Step 5 while the graph grows: when it is optimised, and how much of it."""

    moved: float = 0.1
    """When joint matches have moved scans by so much in all, m,"""
    new: float = 0.01
    """and so large a share of its keyframes is new:"""
    most: int = 500
    """the keyframes that lie nearest to these, so many,"""
    new_of_all: float = 0.1
    """and all when so large a share is new since all were."""


@dataclass(frozen=True)
class SlamOptions:
    """All of them."""

    odometry_checks: OdometryCheckOptions = field(default_factory=OdometryCheckOptions)
    tracking: TrackingOptions = field(default_factory=TrackingOptions)
    breaks: BreakOptions = field(default_factory=BreakOptions)
    keyframes: KeyframeOptions = field(default_factory=KeyframeOptions)
    nscan: NScanOptions = field(default_factory=NScanOptions)
    closing: ClosingOptions = field(default_factory=ClosingOptions)
    growth: GrowthOptions = field(default_factory=GrowthOptions)
    rejection: RobustOptions = field(default_factory=RobustOptions)
    diagnostics: DiagnosticsOptions = field(default_factory=DiagnosticsOptions)
    relations: Relations = "both"
    """both: the chain of pairwise relations from tracking, and nScan relations of joint matches. nscan: of
    the chain only what no nScan relation holds together. pairwise: the chain, and each scan near a keyframe
    matched with it alone."""
    refinements: int = 2
    """Most sweeps of joint matches from the final poses."""
    refined: float = 0.02
    """A joint match is made again when a scan has moved by so much (m, rad) since."""
