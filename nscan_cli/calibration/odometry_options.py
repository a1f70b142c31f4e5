"""The parameters of what may be wrong with odometry: its clock, and what changes within a log."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.calibration.sweep_options import ScanTurnOptions


@dataclass(frozen=True)
class ClockOptions:
    """How the offset between the clocks of odometry and scans is looked for."""

    span: float = 120.0
    """Largest clock offset that is tried, s. A larger value takes longer."""
    resolution: float = 0.1
    """Interval between the offsets that are tried, s. A smaller value takes longer."""
    longest_gap: float = 2.0
    """Over a longer gap odometry tells no turn, s: as long as the longest step that is measured. A larger
    value takes turns over longer gaps for steady."""
    min_told: float = 0.5
    """Turns may agree at an offset if odometry tells this share of them there. A smaller value finds an
    offset by fewer turns."""
    max_difference: float = 0.1
    """Turns of a step that differ by more count as different by this, rad: such steps are slips, or matches
    that failed. A larger value gives them more weight."""
    gain: float = 0.6
    """An offset is found if the turns disagree by less than this share of their disagreement without it, and
    of that anywhere else. With a larger share an offset is found more often, also where there is none.
    Mirrored turns are found in the same way."""
    max_left: float = 0.85
    """Largest share by which turns disagree with an offset that is found. They disagree by 1 where odometry
    does not turn. A larger share finds more where a robot hardly turns, also false ones."""
    first_gain: float = 0.8
    """More steps are measured where the share of the first few is less than this. A larger value takes
    longer."""
    max_disagreement: float = 0.8
    """An offset is looked for, however well most turns agree, if turns as stamped disagree by more than this
    share. A larger value takes less time."""
    min_offset: float = 0.5
    """Smallest offset that a warning names, s: tracking hardly notices a smaller one. A larger value warns
    less."""


@dataclass(frozen=True)
class DelayOptions:
    """When odometry is late or early, by the steps of any laser."""

    longest: float = 1.5
    """Longest delay that is looked for, s. A larger value takes longer."""
    step: float = 0.02
    """Interval between the delays that are tried, s. A smaller value takes longer."""
    least: float = 0.2
    """Smallest delay that is corrected, s. Tracking hardly notices a smaller one. A larger value leaves the
    file as it is more often."""
    min_turn: float = 0.05
    """Least turn of a step that counts, rad. With a larger value fewer steps count, and each tells more."""
    map_turn: float = 0.1
    """Turns of a finished map are counted each time the robot has turned so far, rad. A larger value counts
    fewer, which take longer."""
    min_turns: int = 12
    """Least number of steps with a turn. A larger value finds less in short drives."""
    max_difference: float = 0.1
    """Turns of a step that differ by more count as different by this, rad. A larger value gives slips and
    failed matches more weight."""
    max_left: float = 0.7
    """A delay is found if turns disagree by at most this share of their disagreement without it. A larger
    value finds delays more often, also where there is none."""
    max_disagreement: float = 0.5
    """Largest disagreement of the turns with the delay, as a share of the turns by scans. Where odometry
    turns the wrong way, they disagree less with any delay. A larger value finds more."""
    sigmas: float = 4.0
    """Least mean gain of the turns with the delay, in its standard deviations. A larger value finds less."""
    first_sigmas: float = 1.0
    """More steps are measured where the first few gain so much: of ten times as many, the gain is three times
    as clear. A larger value takes less time, and finds less."""
    first_turns: int = 5
    """And where so many of these have a turn. A larger number takes less time, and finds less where robots
    seldom turn."""
    fitted: int = 3
    """Number of delays on each side of the best one that a parabola fits. With more the curve is less like a
    parabola."""


@dataclass(frozen=True)
class ScaleChangeOptions:
    """When odometry, or the ranges, change their scale within a log."""

    min_length: float = 0.05
    """Least length of a step, m. With a larger value fewer steps count, and each tells more."""
    max_sigma: float = 0.15
    """Largest standard deviation of such a length, as a share of it. A larger value lets more steps count,
    also those along bare walls."""
    min_steps: int = 8
    """Least number of steps before a change, and behind. A larger value finds fewer changes."""
    min_factor: float = 1.09
    """Least factor between the scales before and behind. It is 1.08 at most in recordings of
    others. A larger value warns less."""
    sigmas: float = 5.0
    """Least size of the change, in its standard deviations. It is 3 at most on real logs. A larger value
    warns less."""
    doubt_sigmas: float = 2.0
    """More steps are measured where a change exceeds this number of its standard deviations. A larger value
    takes less time."""


@dataclass(frozen=True)
class ViewChangeOptions:
    """When the readings come in another order, or the laser looks elsewhere, from a scan on."""

    min_turn: float = 0.05
    """Least turn of a step whose sign counts, rad. With a larger value fewer steps count, and each tells
    more."""
    min_length: float = 0.05
    """Least length of a step whose direction counts, m. With a larger value fewer steps count, and each tells
    more."""
    max_step_turn: float = 0.15
    """Largest turn of a step whose direction counts, rad. With a larger value more steps count, and each
    tells less where odometry is late."""
    min_steps: int = 8
    """Least number of such steps before a change, and behind. A larger value finds fewer changes."""
    min_agreement: float = 0.6
    """Least mean of the signs of turns on both sides: at 0.6 four of five are alike. A larger value finds
    fewer changes."""
    min_direction: float = 0.045
    """Least change of the direction of the laser, rad. It is 0.03 at most on real logs. A larger value warns
    less."""
    sigmas: float = 5.0
    """Least change of that direction, in its standard deviations. A larger value warns less."""
    part_weight: float = 0.8
    """The standard deviation by parts of `min_steps` steps counts by this factor. Headings by odometry drift,
    so steps beside each other are off by the same. A larger factor warns less."""
    max_part_sigma: float = 0.03
    """Largest such standard deviation that counts, rad: headings drift no farther. A larger value warns
    less."""
    min_left: float = 0.05
    """A stretch in the middle is looked for if one change leaves so much of the directions unexplained, as a
    share: their mean square, rad², in small. A larger value finds fewer stretches."""
    max_left_of_stretch: float = 0.3
    """Such a stretch leaves less than this share of that. A larger value finds more."""
    doubt_steps: int = 2
    """More steps are measured where so many steps before and behind show a change. A larger value takes less
    time, and misses what changes near the beginning or the end."""
    doubt_sigmas: float = 3.0
    """More steps are measured where a change of direction exceeds this number of standard deviations. A
    larger value takes less time."""


@dataclass(frozen=True)
class OdometryUnitOptions:
    """When odometry counts in another unit over a part of the log."""

    too_fast: float = 15.0
    """No robot that maps drives faster, m/s. A larger value finds less."""
    still: float = 0.01
    """A robot that is slower by odometry tells nothing, m/s. A larger value counts fewer steps."""
    min_steps: int = 20
    """Least number of steps from scan to scan that are too fast, and of others with motion. A larger value
    finds less."""
    beside: int = 2
    """A step is judged together with so many steps with motion before it, and behind. A larger value finds
    less."""
    most_beside: int = 3
    """Least number of large steps among these, about a step in the other unit. A larger value finds less."""
    measured_steps: int = 12
    """Number of steps of both kinds that are measured, spread over the log. More tell more and take
    longer."""
    min_measured: int = 4
    """Least number of these steps, of both kinds, that the scans measure. A larger value finds less."""
    tolerance: float = 0.2
    """Odometry has changed from metres to another unit if one metre by it is one by scans, and then one of
    that unit, to within this share. A larger value finds more."""


@dataclass(frozen=True)
class UnsignedOdometryOptions:
    """When odometry counts reversing as driving forward."""

    max_backward_share: float = 0.002
    """Odometry goes one way if it goes the other way over no more than this share of the path. It is 0.0008
    at most on real logs whose odometry never reverses, and 0.14 where it does. A larger value checks more
    logs."""
    step_length: float = 0.1
    """Length of a step over which ranges are compared, m. A larger value misses short reversals."""
    max_duration: float = 3.0
    """Longest step that is compared, s. A larger value compares across longer gaps."""
    max_beams: int = 180
    """Approximate number of beams of a scan that are compared, evenly spread. More take longer."""
    min_beams: int = 20
    """Least number of beams of a step that are compared. A larger value compares fewer steps."""
    first_beams: int = 60
    """Approximate number of beams of a scan that are compared first. More take longer."""
    min_first_beams: int = 7
    """Least number of these beams of a step. A larger value takes less time."""
    first_error_ratio: float = 0.75
    """All beams are compared if these are off by less than this share in the other direction, in `min_steps`
    steps. A larger value takes longer."""
    max_error: float = 0.3
    """Largest difference between a range and its prediction that counts, m: beyond it another thing is seen.
    A larger value gives edges more weight."""
    max_error_ratio: float = 0.7
    """A step is clear if the ranges are off by less than this share in one direction of that in the other. A
    larger value finds more, also by chance. At this one 2 of 36,000 steps of real logs are clear by
    chance."""
    min_steps: int = 2
    """Least number of successive clear steps that go the other way, in one stretch at least. Where there is
    one, shorter ones count too, if scans confirm them. A larger value finds less."""
    max_stop_speed: float = 0.8
    """At both ends of such a stretch the robot slows down to this share of its greatest speed in it, at
    least: it has to stop to change its direction, though scans that are far apart blur it. A larger value
    finds more."""
    measured_steps: int = 5
    """Number of steps of such a stretch that are matched; most must agree. More take longer."""


@dataclass(frozen=True)
class HeldOdometryOptions:
    """When odometry stands for a part of the log though the robot moves."""

    still: float = 1e-6
    """Odometry stands between two scans if no coordinate changes by more, m and rad. A larger value counts
    slow motion as standing."""
    min_duration: float = 3.0
    """Shortest time that odometry has to stand, s. A smaller value finds more, and takes longer."""
    min_heading_duration: float = 20.0
    """Shortest time that the heading alone has to stand, s: it does on straight ways. A smaller value finds
    more, and takes longer."""
    scan_turns: ScanTurnOptions = field(default_factory=ScanTurnOptions)
    """How a rough look tells that the robot hardly turns there."""
    min_turn: float = 0.08
    """Turn of a step that contradicts it, rad: on straight ways few turn by 0.03. More finds less."""
    changed_range: float = 0.1
    """A range has changed if it differs by more than this at both ends of that time, m. A larger value finds
    less."""
    min_changed_share: float = 0.2
    """Least share of ranges that have changed. A smaller value also finds robots in bare corridors; more
    steps are then measured where robots stand."""
    steps: int = 7
    """Number of steps that are measured, spread over that time. More tell more and take longer."""
    more_steps: int = 28
    """Number of steps where these tell too little, as outdoors or in stop and go. More take longer."""
    rough_steps: int = 400
    """Number of steps that are looked at for turns. More find more."""
    min_measured: int = 3
    """Least number of steps that the scans measure. A larger value finds less."""
    standing_share: float = 0.3
    """The robot stands if no more than this share of the first few steps have motion; where robots stand on
    real logs it is 0.15 at most. A larger value takes less time."""
    min_moving_share: float = 0.7
    """Least share of the measured steps with motion. A larger value finds less; a small one takes people who
    pass a standing robot for motion."""
    min_lost_turn: float = 0.1
    """Headings are turned if they are off the way that the robot drives by more behind such a time, rad. A
    larger value turns less often."""
    min_driven: float = 0.01
    """Shortest step that tells which way the robot drives, m. A larger value needs faster robots."""
    min_driven_steps: int = 50
    """Least number of these steps on both sides. A larger value turns less often."""
    min_agreement: float = 0.9
    """Length of the mean of the directions of these steps, 1 if all are the same. A larger value turns less
    often."""
