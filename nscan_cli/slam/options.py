"""The parameters of the SLAM loop, one set for all logs; what the graph's provenance records."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.graph.optimise.graduated_nonconvexity import RobustOptions
from nscan_cli.slam.backend.options import (
    DegenerateRelationOptions,
    OptimisationOptions,
    RefinementOptions,
    ScheduleOptions,
    SingleScanOptions,
    UnevenMotionOptions,
)
from nscan_cli.slam.diagnostics.options import DiagnosticsOptions
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.odometry_checks import OdometryCheckOptions
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.keyframes.options import KeyframeOptions
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.options import LoopClosureOptions


@dataclass(frozen=True)
class SystematicErrorOptions:
    """When a drive is mapped again without a systematic error of its odometry."""

    window: float = 4.0
    """Length of the pieces of the path that are compared, m. Longer ones have less noise, and are fewer."""
    short_window: float = 0.5
    """Length of shorter pieces of the path, m: most of these are off, too. A shorter one has more noise, and
    a longer one is more likely off by a jump of the odometry."""
    min_straightness: float = 0.5
    """Least distance between both ends of a piece, as a share of its length. A larger share leaves out more
    pieces with turns."""
    min_pieces: int = 8
    """Least number of pieces that make an error certain. A larger number leaves more odometry as it is."""
    sigmas: float = 6.0
    """An error is certain if it exceeds this number of its standard deviations. A larger number leaves more
    odometry as it is."""
    parts: int = 4
    """Number of parts of the drive in each of which ways are off. More parts leave more odometry as it is."""
    min_part: float = 0.5
    """Least share of the mean by which they are off in each part, and in most short pieces. A larger share
    leaves more odometry as it is."""
    min_length: float = 0.05
    """Least share by which ways are too long or too short. A larger share leaves more odometry as it is."""
    max_length: float = 0.4
    """Largest share by which ways are too long or too short. Where it is larger, the scans may tell none, as
    with dust in front of the laser. A larger share corrects more odometry."""
    min_more_length: float = 0.02
    """Least share by which ways are too long or too short once the drive was mapped again. A larger share
    stops earlier."""
    max_runs: int = 3
    """Largest number of times that a drive is mapped again. A larger number takes longer."""


@dataclass(frozen=True)
class BridgedGapOptions:
    """When a drive is mapped again with the way over a gap of its odometry that both sides tell."""

    sigma: float = 0.04
    """Standard deviation beyond which a scan does not tell how far the robot went, m. A larger value takes
    more of the way from the scans."""
    least_speed: float = 0.05
    """A slower robot stands, m/s. A larger value makes its usual speed that of fast drives."""
    min_ahead: float = 0.8
    """Least length of the mean direction of its steps. A larger value leaves out robots that also drive
    backward or sideways."""
    slowest: float = 0.3
    """Least speed where scans do not tell it, as a share of its usual one. A larger share bridges fewer
    gaps."""
    fastest: float = 1.5
    """Greatest speed there, as a multiple of its usual one. A larger multiple bridges more gaps."""
    max_turn: float = 0.35
    """Most that odometry may turn otherwise than the map over a gap, rad. A larger value bridges more."""
    max_apart: float = 0.2
    """Both sides meet if they are no farther apart than this, m. A larger value bridges more gaps."""
    max_apart_share: float = 0.1
    """And this share of the way over the gap. A larger share bridges more gaps."""
    least_gain: float = 0.2
    """In the map the end of the gap is off by more than this, m. A larger value leaves more maps as they
    are."""
    gain_for_apart: float = 2.0
    """And more by this multiple of how far both sides are apart. A larger multiple leaves more maps as they
    are."""


Relations = Literal["pairwise", "nscan", "both"]
"""What the graph is made of; see SlamOptions."""


@dataclass(frozen=True)
class SlamOptions:
    """The options of all steps."""

    file_check: FileCheckOptions = field(default_factory=FileCheckOptions)
    """What scans contradict of their file, before step 1."""
    odometry_checks: OdometryCheckOptions = field(default_factory=OdometryCheckOptions)
    """Which steps of the odometry are jumps."""
    tracking: TrackingOptions = field(default_factory=TrackingOptions)
    """Step 1: how scans are matched with the local map."""
    breaks: BreakOptions = field(default_factory=BreakOptions)
    """When the track is broken."""
    keyframes: KeyframeOptions = field(default_factory=KeyframeOptions)
    """Step 2: which scans become keyframes."""
    nscan: NScanOptions = field(default_factory=NScanOptions)
    """How a keyframe is matched with its neighbours, jointly or with each alone."""
    loop_closure: LoopClosureOptions = field(default_factory=LoopClosureOptions)
    """Step 4: how a place seen before is searched, and what its match has to stand."""
    schedule: ScheduleOptions = field(default_factory=ScheduleOptions)
    """When the growing graph is optimised."""
    optimisation: OptimisationOptions = field(default_factory=OptimisationOptions)
    """How exactly the graph is optimised."""
    single_scans: SingleScanOptions = field(default_factory=SingleScanOptions)
    """When a single scan is off its neighbours."""
    rejection: RobustOptions = field(default_factory=RobustOptions)
    """When a loop contradicts the rest of the graph."""
    uneven_motion: UnevenMotionOptions = field(default_factory=UnevenMotionOptions)
    """When and how the path of a turning laser is matched more finely."""
    refinement: RefinementOptions = field(default_factory=RefinementOptions)
    """Step 6: which matches are made again from the final poses."""
    degenerate_relations: DegenerateRelationOptions = field(default_factory=DegenerateRelationOptions)
    """How certain the length of a way is that no scan tells."""
    clock_runs: int = 2
    """How often a drive is mapped again at most with other stamps of its odometry: a clock may be set within
    the log, and be late besides. With 0 the check of the file alone decides."""
    odometry_gaps: BridgedGapOptions = field(default_factory=BridgedGapOptions)
    """When the drive is mapped again with the way over gaps of its odometry."""
    systematic_error: SystematicErrorOptions = field(default_factory=SystematicErrorOptions)
    """When a drive is mapped again without a systematic error of its odometry."""
    diagnostics: DiagnosticsOptions = field(default_factory=DiagnosticsOptions)
    """When the finished map warns its user."""
    relations: Relations = "both"
    """both: the chain of pairwise relations from tracking, and nScan relations of joint matches. nscan: of
    the chain only what no nScan relation holds together. pairwise: the chain, and each scan near a keyframe
    matched with it alone."""
