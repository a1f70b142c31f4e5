"""Options of steps 5 and 6 of the loop: when the graph is optimised, until when, and how it is refined."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.graph.optimise.graph_solver import StopOptions


@dataclass(frozen=True)
class ScheduleOptions:
    """When the growing graph is optimised, and how much of it."""

    min_motion: float = 0.1
    """Least sum of the motions of scans in matches since the last optimisation, m. A larger one optimises
    less often."""
    min_new_share: float = 0.01
    """Least share of keyframes that are new since the last optimisation. A larger share optimises less
    often."""
    max_keyframes: int = 500
    """Most keyframes that are optimised at a time: those nearest to the new ones. A larger number is slower
    and more exact."""
    whole_new_share: float = 0.1
    """All keyframes are optimised once this share of them is new since the last time. A larger share is
    faster and less exact."""


@dataclass(frozen=True)
class OptimisationOptions:
    """How exactly the graph is optimised."""

    growing: StopOptions = field(default_factory=lambda: StopOptions(max_iterations=10, tolerance=1e-3))
    """While keyframes are added: the next matches start from these poses, which need not be exact."""
    after_large_loop: StopOptions = field(
        default_factory=lambda: StopOptions(max_iterations=100, tolerance=1e-4)
    )
    """After a search has closed a loop, which moves much of the graph."""
    final: StopOptions = field(default_factory=StopOptions)
    """Once all keyframes are added."""
    metres_per_radian: float = 0.3
    """A turn by 1 rad counts as this length of path where the scans between keyframes share a correction of
    the graph, m. A larger value puts more of the correction into turns."""


@dataclass(frozen=True)
class SingleScanOptions:
    """When a single scan is off its neighbours, while odometry goes on evenly."""

    min_jump: float = 0.1
    """Least difference of the step from it and that to it, m. A larger value leaves more scans where they
    were matched."""
    max_share: float = 0.25
    """Largest share of this difference that odometry may have, too. A larger value believes odometry more
    often."""
    max_return: float = 0.5
    """What both steps are off odometry adds up to at most this share of their difference. With a larger value
    the scan may also part its neighbours."""
    max_step: float = 0.1
    """Longest step by odometry to such a scan and from it, m: over longer ones odometry tells less than the
    match. A larger value believes odometry more often."""
    metres_per_radian: float = 1.0
    """A turn by 1 rad counts as this length, m. A larger value finds more scans that are turned."""


@dataclass(frozen=True)
class UnevenMotionOptions:
    """When and how the path of a robot is matched more finely, if its laser turns."""

    odometry_periods: float = 0.4
    """Odometry with poses at most so far apart, in the times from scan to scan, tells the motion within a
    sweep. A larger value believes coarser odometry."""
    min_change: float = 0.05
    """The motion is uneven if the way during one sweep of the laser differs by more from that during the
    next, m. A larger value takes less time, and leaves the poses between two sweeps less certain."""
    min_turn_change: float = 0.04
    """The motion is also uneven if the turns of the robot during two such sweeps differ by more, rad. A
    larger value takes less time, and leaves the headings less certain."""
    longest_step: float = 2.5
    """Longest step from scan to scan whose motion is known, in usual steps. A larger value believes more of
    them."""
    scans: int = 6
    """Number of scans before, and as many after, that those in uneven motion are matched with. More tell more
    and take longer."""
    longest_run: int = 8
    """Largest number of scans in uneven motion that are matched together. More bend the path at fewer places,
    and leave it farther from what they are matched with."""
    parts: int = 4
    """Number of parts of steady motion from the middle of one sweep to the next. With more the moment when a
    turn of the robot begins is more exact, and it takes longer."""
    groups: int = 2
    """Number of groups of beams in each part, which are matched from where the robot was in their middle.
    More are more exact and take longer."""
    speed_change: float = 0.05
    """Usual change of the speed from one part to the next, m/s. With a larger value the path is rougher where
    the beams tell little."""
    turn_change: float = 0.1
    """Usual change of the turn rate from one part to the next, rad/s. With a larger value the headings are
    rougher where the beams tell little."""
    iterations: int = 8
    """Largest number of Newton steps in a stage. A larger number lets slow matches converge."""
    sigma: float = 0.05
    """Standard deviation of the known places at the middles of the sweeps, m: it keeps matches from sliding
    along walls. A larger value believes the beams more."""
    turn_sigma: float = 0.1
    """Standard deviation of the known headings there, rad. A larger value believes the beams more."""
    max_sigmas: float = 3.0
    """The path stays as it was if a place or a heading moves by more of these standard deviations. A larger
    value accepts larger corrections, also wrong ones."""
    min_gain: float = 1.0
    """Least gain of the fit of the beams, in nats for each part, with which the path changes. A larger value
    changes less of it."""
    min_points: int = 50
    """Least mean number of points in a sweep of the laser with which the path changes. With a smaller number
    blind lasers change it."""
    max_beams: int = 240
    """Approximate number of beams of a scan that are matched, evenly spread. More tell more and take
    longer."""
    coarse_stride: int = 2
    """Of the points one in so many is matched in the stages before the last. A larger number is coarser, and
    takes less time."""
    scale: float = 0.3
    """Factor that makes a negative log likelihood of the energy of the beams. A larger value believes them
    more."""
    widenings: tuple[float, ...] = (0.2, 1.0)
    """The w of the energy in each stage of a match: it multiplies the information of the Gaussians, so that
    w < 1 widens them. The last w is 1. With larger ones before, matches converge only from nearer."""
    tolerance: float = 5e-3
    """The last stage has ended when no pose moves by more, m and rad. A larger value is less exact and takes
    less time."""
    coarse_tolerance: float = 2e-2
    """The stages before have ended when no pose moves by more, m and rad. A larger value is less exact and
    takes less time."""


@dataclass(frozen=True)
class RefinementOptions:
    """The matches that are made again from the final poses."""

    max_passes: int = 2
    """Most passes over all keyframes. A larger number is slower."""
    min_motion: float = 0.02
    """A match is made again if a scan has moved by more since, m and rad. A larger one makes fewer again."""


@dataclass(frozen=True)
class DegenerateStretchOptions:
    """When a way without odometry is held by steady motion alone, since its walls look alike all along."""

    sigma: float = 0.15
    """Standard deviation beyond which a scan does not tell its place along the walls, m. A larger value finds
    less."""
    path: float = 2.0
    """Least length of such a way, m: as mapped, or at the robot's usual speed. As mapped it is 2.5 m and more
    in bare corridors, at most 0.7 m elsewhere. A larger value finds less."""
    scans_between: int = 2
    """Largest number of successive scans within it that seem to tell their place. A larger number joins more
    ways."""
    least_speed: float = 0.05
    """A slower robot stands, m/s. A larger value makes the usual speed that of fast drives."""
    min_steps: int = 5
    """Least number of steps elsewhere that tell which way the robot drives. With a larger number its mapped
    steps in such ways tell it more often."""
    min_ahead: float = 0.8
    """Least length of the mean direction of these steps: a robot that drives in several directions has none.
    With a larger value more robots count as such."""


@dataclass(frozen=True)
class DegenerateRelationOptions:
    """How certain the length of a way is that no scan tells."""

    stretch: DegenerateStretchOptions = field(default_factory=DegenerateStretchOptions)
    """Which ways these are."""
    speed_share: float = 0.5
    """Standard deviation of the robot's speed there, as a share of its usual one: it may stand, or hurry. A
    larger share makes such ways less certain."""
    most_steps: int = 3
    """Largest number of keyframes between two nodes of a relation of one visit. Relations between visits are
    measured, and stay as certain. A larger value makes more relations less certain."""
    revisit_factor: float = 100.0
    """Relations of scans within such a way with another visit measure nothing along it: their variance is
    that of the guess in between, by this factor. With a smaller factor they hold the guess, and all together
    make it certain."""
    direction_length: float = 0.5
    """A step between keyframes that is at least as long has the direction between them, m; on a shorter one
    the robot drives where it looks. A larger value believes headings more often."""
    direction_sigma: float = 0.005
    """Standard deviation of the direction of such a way as a relation has it, rad. Matches of bare walls
    differ by a milliradian. A larger value makes the place across less certain; a smaller one lets relations
    whose directions differ fix the length."""
