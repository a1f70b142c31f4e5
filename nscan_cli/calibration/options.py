"""The parameters of the comparison of scans with what their file says."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from nscan_cli.calibration.companion_options import CompanionOptions
from nscan_cli.calibration.odometry_fault_options import (
    ClockChangeOptions,
    HeadingJumpOptions,
    ReversedHeadingOptions,
    ScaledStretchOptions,
    UnsteadyStampOptions,
)
from nscan_cli.calibration.odometry_options import (
    ClockOptions,
    DelayOptions,
    HeldOdometryOptions,
    OdometryUnitOptions,
    ScaleChangeOptions,
    UnsignedOdometryOptions,
    ViewChangeOptions,
)
from nscan_cli.calibration.range_jump_options import BearingJitterOptions, OrderJumpOptions, RangeJumpOptions
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.logs.expected_sizes import ExpectedSizes


@dataclass(frozen=True)
class FileCheckOptions:
    """When scans contradict what their file says of odometry, mounting and clocks.

    With larger bounds a file is contradicted less often.
    """

    steps: StepOptions = field(default_factory=StepOptions)
    """Which steps are measured, and which measurements count."""
    clock: ClockOptions = field(default_factory=ClockOptions)
    """How the offset between the clocks of odometry and scans is looked for."""
    lag: DelayOptions = field(default_factory=DelayOptions)
    """When odometry is late or early, by the steps of any laser."""
    clock_change: ClockChangeOptions = field(default_factory=ClockChangeOptions)
    """When odometry is late or early in a part of the log alone."""
    unsteady: UnsteadyStampOptions = field(default_factory=UnsteadyStampOptions)
    """When odometry fits the scans at no offset of its stamps."""
    headings: ReversedHeadingOptions = field(default_factory=ReversedHeadingOptions)
    """When headings by odometry count the wrong way, and its positions do not."""
    heading_jumps: HeadingJumpOptions = field(default_factory=HeadingJumpOptions)
    """When headings by odometry jump, and its positions do not."""
    stretches: ScaledStretchOptions = field(default_factory=ScaledStretchOptions)
    """When the lengths of odometry are multiplied by something over a part of the log."""
    sweep: SweepCheckOptions = field(default_factory=SweepCheckOptions)
    """How the time of a laser's sweep is taken from its scans."""
    held: HeldOdometryOptions = field(default_factory=HeldOdometryOptions)
    """When odometry stands though the robot moves."""
    units: OdometryUnitOptions = field(default_factory=OdometryUnitOptions)
    """When a part of the odometry is in another unit."""
    jumps: RangeJumpOptions = field(default_factory=RangeJumpOptions)
    """When all ranges change by one factor from a scan on."""
    order: OrderJumpOptions = field(default_factory=OrderJumpOptions)
    """When readings come in the other order from a scan on."""
    jitter: BearingJitterOptions = field(default_factory=BearingJitterOptions)
    """When first directions jitter in the file alone."""
    change: ScaleChangeOptions = field(default_factory=ScaleChangeOptions)
    """When the scale of odometry or ranges changes within the log."""
    view: ViewChangeOptions = field(default_factory=ViewChangeOptions)
    """When the laser looks elsewhere, or its readings come in another order, from a scan on."""
    unsigned: UnsignedOdometryOptions = field(default_factory=UnsignedOdometryOptions)
    """When odometry counts reversing as driving forward."""
    companion: CompanionOptions = field(default_factory=CompanionOptions)
    """When something goes along with the robot, whose beams are left out."""
    min_steps: int = 12
    """Least number of steps with motion, or with a turn, that a finding rests on. A larger value finds
    less."""
    min_turns_unmeasured: int = 4
    """Least number of steps with a turn by scans where odometry never turns. A larger value finds less."""
    min_turn_share: float = 0.5
    """A step turns by odometry, too, if that says at least this share of the turn by scans. Only such steps
    tell the place of the laser. A larger value finds less."""
    min_driven: float = 0.1
    """A step clearly drives by odometry from this length (m) or turn (rad) on. A larger value finds fewer
    scans that stay the same."""
    min_unchanged_share: float = 0.6
    """Least share of the steps with motion by odometry in which the scans stay the same, where the laser
    likely sees what goes along with the robot. A larger value finds less."""
    still: float = 1e-3
    """Odometry never moves if it stays this near to its first pose, m and rad. A larger value counts small
    motions as none."""
    max_spread: float = 0.25
    """A finding explains the steps if the median residual is at most this share of their motion. A larger
    value accepts poorer explanations."""
    max_tail: float = 0.4
    """A finding explains the steps if the upper quartile of the residuals is at most this share of their
    motion. A larger value accepts poorer explanations."""
    max_sign_tail: float = 0.4
    """Odometry counts x or y the wrong way if with the other sign this quartile is less than this share of
    what it is as recorded, however well that explains the steps. A larger value finds more."""
    min_mount_turn: float = 0.06
    """Least error of the laser's direction in the file that a warning names, rad. It is 0.04 at most on real
    logs, with a standard deviation of 0.02. A larger value warns less."""
    min_mount_move: float = 0.15
    """Least error of the laser's place in the file, along an axis, that a warning names, m. It is 0.1 at most
    on real logs; a late clock looks like some centimetres. A larger value warns less."""
    max_seen_sigma: float = 0.03
    """Odometry that is to agree with the scans has the laser where the steps show it if they tell that place
    to this standard deviation, m; else where the file has it. A larger value believes the steps more."""
    mount_sigmas: float = 5.0
    """An error of the laser's direction, its place or the scale must also exceed this number of its standard
    deviations. A larger value warns less."""
    opposite_within: float = 0.1
    """A laser that seems to look back to within this angle may be one of a robot that seems to drive
    backwards, rad. A larger value takes more lasers for such ones."""
    round_angle: float = math.radians(15.0)
    """A warning suggests a multiple of this angle as the angle of the mounting, rad, if one is near. A
    smaller value suggests more exact angles."""
    round_angle_tolerance: float = math.radians(3.0)
    """Largest distance of a measured angle from such a multiple, rad. A larger value rounds more angles."""
    min_scale_factor: float = 1.09
    """Least factor by which the scale of odometry is wrong, beside `mount_sigmas`. It is 1.08 at most on real
    logs, those of one robot. A larger value warns less."""
    clear_scale_factor: float = 1.2
    """Up to this factor `more_steps` are measured before a warning names it. A larger value takes longer."""
    certain_scale_factor: float = 3.0
    """A scale that is wrong by more than this factor is corrected: no wheel slips so much. A larger value
    corrects less."""
    decimal_tolerance: float = 0.08
    """A scale this near to a power of ten (relative) is that power: the file is in millimetres or
    centimetres. A larger value rounds more scales."""
    range_unit_tolerance: float = 0.1
    """Ranges are likely in feet or inches if odometry and scans differ by that factor within this share: the
    wheels of a robot may be off, too. A larger value says it more often."""
    max_range_factor: float = 10.0
    """A warning of a wrong scale says that the ranges may be wrong instead, up to this factor: with a larger
    one they are not those of a room, as a user sees. A larger value says it more often."""
    expected: ExpectedSizes = field(default_factory=ExpectedSizes)
    """What tells whether ranges or odometry are likelier to be wrong by a factor."""
    likelier_factor: float = 2.5
    """The ranges are named first where they are likelier wrong than odometry by this factor. A larger value
    names odometry more often."""
    likelier_unit_factor: float = 0.35
    """And by this one where the ranges may be in feet or inches, which is likelier than any other factor: it
    is 0.5 of intel in feet, and 0.1 to 0.23 of logs whose odometry is too short by that. A larger value names
    odometry more often."""
    max_turn_error: float = 0.3
    """Largest relative difference of the turns by odometry and by scans. A larger value warns less."""
    turn_sigmas: float = 3.0
    """Where single turns differ by much, their mean must be off by more than that by so many standard
    deviations. A larger value warns less."""
    min_opposite_share: float = 0.8
    """Odometry turns the other way if its turns are opposite to those by scans in this share of the steps,
    however much their sizes vary. A larger value finds less."""
    min_opposite_excess: float = 7.0
    """So many more steps must turn the other way than the same. A larger value finds less."""
    more_steps: int = 200
    """Number of steps of each half of the sample if turns disagree, to find the offset of the clocks; also
    the limit where scans tell little. More take longer."""
    map_sigmas: tuple[float, float, float] = (0.02, 0.02, 0.005)
    """Standard deviations of a step by the finished map, m and rad. Larger values let fewer steps contradict
    the file."""
    max_share: float = 0.04
    """Largest sample where scans tell little, as outdoors, as a share of the scans. A larger value finds more
    there, and takes longer."""
    excluded_spread: float = 0.4
    """Odometry that no finding explains is not used if the median residual is at least this share of the
    motion. It is 0.03 to 0.11 on real logs. A larger value uses poorer odometry."""
    excluded_turn_spread: float = 1.0
    """Odometry is not used if the median residual of its turns is at least this multiple of the turns by
    scans. It is 0.004 to 0.4 on real logs. A larger value uses poorer odometry."""
    parts: int = 3
    """The sample is measured in so many parts, each of which is spread over the log; the others are not where
    one clearly agrees with the file. More take less time, and less evidence is then enough."""
    more_parts: int = 6
    """The larger sample of a log in doubt is measured in so many parts; the others are not where one settles
    it. More take less time, and less evidence is then enough."""
    min_clear_steps: int = 8
    """Least number of steps with motion, and with a turn, that clearly agree. A larger value takes longer."""
    clear_share: float = 0.5
    """Steps clearly agree with the file if their residuals are at most this share of those that a finding may
    have. A smaller value takes longer."""
    clear_sigmas: float = 2.0
    """Steps clearly agree with the file only if every error that a warning names is excluded by this number
    of standard deviations. A larger value takes longer."""
    min_steps_to_exclude: int = 30
    """Least number of steps with motion where odometry is not used. A larger value uses odometry more
    often."""


@dataclass(frozen=True)
class CalibrationOptions:
    """How a robot is calibrated from a drive."""

    steps: StepOptions = field(default_factory=lambda: StepOptions(max_beams=1_000))
    """Which steps are measured, with more beams than for the check of a file."""
    clock: ClockOptions = field(default_factory=ClockOptions)
    """How the offset between the clocks of odometry and scans is looked for."""
    sweep: SweepCheckOptions = field(default_factory=SweepCheckOptions)
    """How the time of the laser's sweep is taken from its scans."""
    min_steps: int = 30
    """Least number of steps with motion. A larger value leaves more drives uncalibrated."""
    min_turns: int = 12
    """Least number of steps with a turn for what turns tell: the place of the laser, and the clocks. A larger
    value leaves these open more often."""
    dependent_steps: int = 3
    """Number of successive steps whose errors depend on each other: they have scans in common. A larger value
    makes standard deviations less certain."""
    max_turn_spread: float = 0.4
    """Turns tell nothing if their median residual is more than this share of them: outdoors single matches
    turn where the robot does not. A larger value believes poorer turns."""
    clock_iterations: int = 5
    """Gauss–Newton steps that refine the clock offset. More are more exact and take longer."""
    angle_sigma: float = 0.005
    """Expected standard deviation of a step's turn between odometry and scans without any turn, rad: it
    weighs the steps against each other. A larger value weighs them more alike."""
    angle_sigma_per_radian: float = 0.1
    """Growth of that standard deviation with the turn, rad/rad. With a larger value large turns weigh
    less."""
    min_sigmas: float = 3.0
    """A value differs from the file's if it is off by more than this number of standard deviations. A larger
    value keeps the file's more often."""
    max_place_sigma: float = 0.02
    """A place of the laser with a larger standard deviation is not applied, m. A larger value applies less
    certain ones."""
    max_angle_sigma: float = 0.01
    """An angle of the mounting with a larger standard deviation is not applied, rad. A larger value applies
    less certain ones."""
    max_scale_sigma: float = 0.01
    """A scale of odometry with a larger standard deviation, as a share, is not applied. A larger
    value applies less certain ones."""
    max_clock_sigma: float = 0.03
    """An offset of the clocks with a larger standard deviation is not applied, s. A larger value applies less
    certain ones."""
    max_sweep_sigma: float = 0.1
    """A time of the laser's sweep with a larger standard deviation, as a share, is not applied. A larger
    value applies less certain ones."""
    max_sideways: float = 0.05
    """Odometry is that of two wheels if its steps go to the side by no more than this share, in the median.
    It is 0.001 to 0.013 on real logs. A larger value takes more robots for ones with two wheels."""
