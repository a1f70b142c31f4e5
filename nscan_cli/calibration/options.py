"""The parameters of the comparison of scans with what their file says."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.matching.pairwise import PairOptions


@dataclass(frozen=True)
class StepOptions:
    """Which steps from scan to scan are measured, and which measurements count."""

    count: int = 30
    """Steps that are spread evenly over the log, and as many more where odometry turns most. More steps tell
    more and take longer."""
    most: int = 1_500
    """Most steps of a calibration, about. More tell more and take longer."""
    chain: int = 12
    """Steps that follow each other whose turns are added up to be compared with those by odometry. Of more,
    stamps that are off matter less, and one match that fails spoils more."""
    duration: float = 0.4
    """Least time of a step, s. Over a longer one the robot moves more, until the scans are too far apart."""
    max_duration: float = 2.0
    """A longer step is not measured, s: scans are missing."""
    max_turn: float = 0.4
    """Of the steps that turn by more than this (rad), none is preferred to another: they may not match."""
    turning_excess: int = 5
    """Those where odometry turns most are chosen evenly among so many times as many. With a larger number
    they come from more places, and turn less."""
    min_overlap: float = 0.6
    """Least share of a scan's points on the other scan."""
    max_beams: int = 180
    """Beams of a scan that are matched, evenly spread, are about so many. More tell more and take longer."""
    probe: float = 0.2
    """A step is measured again from a start this far away (m), in the direction in which it is least certain.
    Along a corridor a match ends where it starts."""
    agreement: float = 0.03
    """Largest difference of the two measurements, m and rad. A larger one accepts less certain steps."""
    min_motion: float = 0.05
    """A step by scans of this length (m) is one with motion, of this turn (rad) one with a turn. With a
    larger value fewer steps tell of it, each of them more."""
    metres_per_radian: float = 0.3
    """A turn of one radian counts as so much motion, m. With a larger value turns weigh more."""
    pair: PairOptions = field(default_factory=PairOptions)


@dataclass(frozen=True)
class ClockOptions:
    """How the offset between the clocks of odometry and scans is looked for."""

    span: float = 120.0
    """Longest offset that is looked for, s. A longer one takes longer."""
    resolution: float = 0.1
    """Distance of the offsets that are tried, s. A finer one takes longer."""
    gain: float = 0.6
    """At the offset the turns have to disagree by less than this share of what they do without, and of what
    they do anywhere. With a larger share an offset is found more often, also where there is none. The same
    holds for mirrored turns, against those that are not."""
    min_offset: float = 0.5
    """A shorter offset is not worth a word, s: tracking hardly notices it."""


@dataclass(frozen=True)
class HeldOdometryOptions:
    """When odometry stands for a part of the log though the robot moves."""

    still: float = 1e-6
    """Odometry stands from one scan to the next if no coordinate changes by more, m and rad."""
    min_duration: float = 3.0
    """Shortest time that it has to stand, s. A shorter one finds more, and takes longer."""
    changed_range: float = 0.1
    """A range that differs by more (m) at both ends of that time has changed."""
    min_changed_share: float = 0.2
    """Least share of ranges that have changed. A smaller one finds robots in bare corridors, too; more is
    measured where robots stand."""
    steps: int = 7
    """Steps that are measured, spread over that time. More tell more and take longer."""
    more_steps: int = 28
    """Steps that are measured where the scans tell too few of these, as outdoors."""
    min_measured: int = 3
    """Least number of them that the scans measure."""
    min_moving_share: float = 0.7
    """Least share of these with motion. A larger one finds less, and never people who pass a robot that
    stands."""


@dataclass(frozen=True)
class CompanionOptions:
    """When something goes along with the robot: readings that end where the robot itself has been or will be.

    Such readings are in 72 to 98 % of the scans with a cart or a follower, in 8 % at most on real logs.
    """

    scans: int = 100
    """Scans that are looked at, evenly spread over the way. More take longer."""
    max_beams: int = 180
    """Beams of a scan that are looked at, evenly spread, are about so many. More take longer."""
    min_way: float = 5.0
    """Least way of a drive, m. A larger one believes short logs."""
    longest_step: float = 1.0
    """Longest step from scan to scan of one way, m. Beyond it the robot was carried or lost."""
    nearest: float = 0.25
    """The path is looked at from so far before and behind it, m. A larger value misses what is near."""
    farthest: float = 4.0
    """And up to so far, m. A larger value finds more, also where odometry has drifted into a wall."""
    path_step: float = 0.05
    """Distance of the points of the path, m. A smaller value takes longer."""
    clearance: float = 0.2
    """Points of the path that are nearer to the robot are not looked at, m: it is there now."""
    max_range: float = 1.5
    """Longest reading that is looked at, m. A larger value finds who follows farther away, and does less
    harm."""
    radius: float = 0.12
    """A reading is on the path within this distance of it, m: half the width of a small robot. A larger value
    takes walls beside the path for something that goes along."""
    min_beams: int = 2
    """Least number of such readings of a scan."""
    min_share: float = 0.3
    """Least share of scans with them. A smaller value finds who goes along for a part of the way."""
    max_gap: float = 0.2
    """Readings next to each other are of one thing within this distance, m."""
    max_size: float = 0.5
    """Greatest distance of its readings from the middle of those on the path, m. A larger one hides more."""
    min_sector_share: float = 0.07
    """Bearings at which it is seen in more than this share of these scans are left out. A larger value leaves
    out less."""


@dataclass(frozen=True)
class FileCheckOptions:
    """When scans contradict what their file says of odometry, mounting and clocks.

    With larger bounds a file is contradicted less often.
    """

    steps: StepOptions = field(default_factory=StepOptions)
    clock: ClockOptions = field(default_factory=ClockOptions)
    sweep: SweepCheckOptions = field(default_factory=SweepCheckOptions)
    held: HeldOdometryOptions = field(default_factory=HeldOdometryOptions)
    companion: CompanionOptions = field(default_factory=CompanionOptions)
    min_steps: int = 12
    """Least number of steps that a finding rests on: with motion, or with a turn."""
    still: float = 1e-3
    """Odometry that stays this near to its first pose (m and rad) never moves."""
    max_spread: float = 0.25
    """A finding explains the steps if the median of what is left is at most this share of their motion."""
    max_tail: float = 0.4
    """The same for the upper quartile of what is left."""
    min_mount_turn: float = 0.1
    """The laser looks another way than the file says by more than this, rad. It is 0.04 at most on real
    logs."""
    min_mount_move: float = 0.15
    """The laser is elsewhere than the file says by more than this along an axis, m. It is 0.1 at most on
    real logs, and a clock that is late looks like some centimetres."""
    mount_sigmas: float = 5.0
    """And by more than so many standard deviations of what the steps say."""
    min_scale_factor: float = 1.2
    """The scale of odometry is wrong by more than this factor, and by more than `mount_sigmas`. It is 1.11 at
    most on real logs."""
    certain_scale_factor: float = 3.0
    """A scale that is wrong by more than this factor is put right: no wheel slips so much."""
    decimal_tolerance: float = 0.08
    """A scale this near to a power of ten, as a share, is that: a file is in millimetres or centimetres."""
    max_turn_error: float = 0.3
    """Turns by odometry are wrong if they differ by more than this share from those by scans."""
    more_steps: int = 200
    """Steps of each half of the sample where turns disagree, to find the offset of the clocks. No more where
    a smaller sample tells too little."""
    max_share: float = 0.04
    """Most steps of a sample that is enlarged because it tells too little, as a share of the scans. A larger
    value finds more where scans tell little, as outdoors, and takes longer."""
    excluded_spread: float = 0.4
    """Odometry that no finding explains is not used where the median of what is left is at least this share
    of the motion. It is 0.03 to 0.11 on real logs."""
    excluded_turn_spread: float = 1.0
    """Odometry is not used where the median of what is left of its turns is at least this multiple of the
    turns by scans. It is 0.004 to 0.4 on real logs."""
    min_steps_to_exclude: int = 30
    """Least number of steps with motion for that."""


@dataclass(frozen=True)
class CalibrationOptions:
    """How a robot is calibrated from a drive."""

    steps: StepOptions = field(default_factory=lambda: StepOptions(max_beams=1_000))
    clock: ClockOptions = field(default_factory=ClockOptions)
    sweep: SweepCheckOptions = field(default_factory=SweepCheckOptions)
    min_steps: int = 30
    """Least number of steps with motion."""
    min_turns: int = 12
    """Least number of steps with a turn for what turns tell: the place of the laser, and the clocks."""
    max_turn_spread: float = 0.4
    """Turns tell nothing where, in the median, they are off by more than this share of them: outdoors single
    matches turn where the robot does not."""
    clock_iterations: int = 5
    """Gauss-Newton steps that refine it."""
    angle_sigma: float = 0.005
    """Standard deviation that is expected of a step's turn by odometry and scans, rad, without any turn: it
    weighs the steps against each other."""
    angle_sigma_per_radian: float = 0.1
    """Increase of it for each radian turned."""
    min_sigmas: float = 3.0
    """A value that is nearer to the file's, in standard deviations, is that of the file."""
    max_place_sigma: float = 0.02
    """A mounting with a larger standard deviation (m) is not passed on: the file's holds."""
    max_angle_sigma: float = 0.01
    """The same for its angle, rad."""
    max_scale_sigma: float = 0.01
    """The same for the scale of odometry, as a share."""
    max_clock_sigma: float = 0.03
    """The same for the offset of the clocks, s."""
    max_sweep_sigma: float = 0.1
    """The same for the time of the laser's turn, as a share."""
    max_sideways: float = 0.05
    """Odometry is that of two wheels if its steps go to the side by no more than this share, in the median.
    It is 0.001 to 0.013 on real logs."""
