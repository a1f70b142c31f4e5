"""The parameters of what scans tell of the sweep of their laser."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class ScanTurnOptions:
    """How turns of the robot are estimated from the ranges of two scans alone."""

    cells: int = 120
    """Directions all around, for each of which a scan has one range. More are finer and take longer."""
    most_cells: int = 20
    """Largest turn that is looked for, in cells. A larger value takes longer."""
    max_difference: float = 0.5
    """Ranges that differ by more count as different by this, m: they are of different things. A larger value
    gives edges more weight."""


@dataclass(frozen=True)
class SweepTimeOptions:
    """How the time of a sweep is measured, with its standard deviation."""

    scans: int = 480
    """Number of scans, evenly spread, among which turns of the robot are looked for. More find more and take
    longer."""
    most_rows: int = 240
    """Largest number of these that pairs begin with: those where the robot turns fastest. More take
    longer."""
    pairs: int = 60
    """Largest number of pairs of scans that are matched. More tell more and take longer."""
    max_beams: int = 360
    """Approximate number of beams of a scan that are matched, evenly spread. More tell more and take
    longer."""
    reach: float = 1.4
    """Times are tried in both directions up to this multiple of the longest possible sweep, so that the best
    one is not at an end. A larger value takes longer."""
    step: float = 0.1
    """Interval between the times that are tried, in longest sweeps. A smaller value takes longer."""
    fitted: int = 3
    """Number of times on each side of the best one that a parabola fits. With more the curve is less like a
    parabola."""
    max_change: float = 0.3
    """The robot turns steadily if its rate before and after a scan differs by less than this share. With a
    smaller value fewer pairs are left, with a larger one the time comes out too long."""
    slow: float = 0.1
    """Turns slower than this are judged by the change that a turn at this rate may have, rad/s. A larger
    value accepts more slow turns."""
    min_steady: int = 30
    """With fewer pairs of scans in steady turns, pairs in uneven turns are used too. A larger value uses them
    more often."""
    cap: float = 0.6
    """Matches slip, so the energy of a pair counts up to this share of the median depth of all pairs above
    its minimum. With a smaller share fewer times beside the best one count."""
    unsteadiness: float = 0.03
    """Standard deviation that turns add to the time, as a share of it, where their rates change by up to
    `max_change` on average; more in proportion where by more. A larger value believes the file more often."""
    sigmas: float = 3.0
    """The measured time differs from another one if it is off by at least this number of standard deviations.
    A larger value believes the file more often."""


@dataclass(frozen=True)
class SweepCheckOptions:
    """How the time of a laser's sweep is taken from its scans."""

    scans: int = 240
    """Scans, evenly spread, among which turns are looked for. More find more, and take longer."""
    scans_apart: int = 2
    """At most one in this number of scans is measured. A larger value takes less time in short logs."""
    scans_beside: int = 6
    """Scans on each side of one in a turn that are looked at, too, where there are few. More find more and
    take longer."""
    min_scans: int = 30
    """Shortest log that is checked, scans. A larger value leaves more short logs unchecked."""
    pairs: int = 24
    """Most pairs of scans that are compared, those where the robot turns fastest. More tell more and take
    longer."""
    min_pairs: int = 5
    """Least number of scans that pairs begin with, whose spread tells how certain their mean is. A larger
    value finds less."""
    outlier_sigmas: float = 3.0
    """A pair that is farther from the median than this number of standard deviations counts as if it were so
    far: matches slip. A larger value gives such pairs more weight."""
    least_pairs: int = 5
    """Least number of pairs after which the file can count as right, or another time as hopeless. More take
    longer where it is."""
    settled_sigmas: float = 1.5
    """The comparison ends once the best time, the file's or one that is decided, makes scans sharper than all
    others by this number of standard deviations. A larger value takes longer."""
    decided_sigmas: float = 6.0
    """Another time is decided once it makes scans sharper than the file's by this number of standard
    deviations. A larger value takes longer."""
    dropped_sigmas: float = 2.0
    """A time that fits worse than the file's by this number of standard deviations is not tried on more
    pairs. A larger value takes longer."""
    hopeless_sigmas: float = 1.0
    """The comparison also ends once the best time makes scans sharper than the file's by less than this
    number of standard deviations. A larger value takes less time, and leaves the file as it is more often."""
    least_decisive: int = 10
    """Least number of pairs after which another time is decided, or a time is dropped. More take longer."""
    shifts: tuple[int, ...] = (-2, 2, -4, 4, -7, 7)
    """Scans from the first of a pair to the second: the robot must move differently there and see the same.
    More shifts find more pairs and take longer."""
    longest_step: float = 0.5
    """Longest time between two scans over which motion is measured, s. A larger value uses sparser logs."""
    max_apart: float = 0.6
    """Largest turn between the scans of a pair, rad. A larger value finds more pairs, some of which do not
    match."""
    min_winding: float = math.radians(2.5)
    """Least turn of the robot during a sweep of the laser, and least difference of two such turns, rad. A
    larger value tells more of each pair, and finds fewer."""
    least_winding: float = math.radians(1.0)
    """Least turn of the robot, and least difference of two, where the file has times of beams and fewer than
    `min_pairs` turn by `min_winding`, rad. A smaller value finds shorter times that are wrong, and takes
    longer."""
    least_factor: float = 1.25
    """Other times of a sweep are tried that differ from the file's by at least this factor. With a smaller
    value the file is compared with times that are hardly another one, which takes time."""
    likelier_sigmas: float = 2.0
    """The time of a sweep is measured if another length than the file's makes scans sharper by this number of
    standard deviations. A larger value takes less time, and believes the file more often."""
    shortest: float = 0.012
    """Shortest scan period of such a laser, s. A smaller value checks more lasers."""
    longest: float = 0.5
    """Longest scan period of such a laser, s. A larger value checks more lasers."""
    scan_turns: ScanTurnOptions = field(default_factory=ScanTurnOptions)
    """How turns of the robot are found."""
    time: SweepTimeOptions = field(default_factory=SweepTimeOptions)
    """How the time of a sweep is measured where the file has none, and by `calibrate`."""
    longest_delay: float = 1.0
    """Longest delay of odometry that is looked for, s. A larger value takes longer."""
    delay_step: float = 0.01
    """Interval between the delays that are tried, s. A smaller value takes longer."""
    delays_fitted: int = 3
    """Number of delays on each side of the best one that a parabola fits. With more the curve is less like a
    parabola."""
    least_delay: float = 0.03
    """Smallest delay of odometry that is corrected, s. A larger value leaves the file as it is more often."""
    delay_gain: float = 0.75
    """A delay is found if the turns disagree by at most this share of their disagreement without it. A larger
    value finds delays more often, also where there is none."""
    no_delay_gain: float = 0.9
    """No more turns are measured where half of them disagree by more than this share with any delay. A larger
    value takes longer."""
    stamp_tolerance: float = 0.25
    """A delay of odometry is due to scans stamped at another beam if that explains it to within this share of
    the time between two such beams. A larger value blames the stamps more often, and the clock of odometry
    less."""
    stamp_excess: float = 1.3
    """A beam that scans may be stamped at explains a delay, too, if turns disagree with it by at most this
    multiple of their least disagreement. A larger value blames the stamps more often."""
    min_delay_turns: int = 15
    """Least number of scans in turns that a delay rests on. A larger value finds less."""
    few_delay_turns: int = 8
    """Least number of scans in turns that a clear delay rests on. A larger value finds less in short
    drives."""
    few_delay_gain: float = 0.4
    """A delay is clear if turns disagree by at most this share of their disagreement without it. A larger
    value finds more in short drives, also where there is none."""
    max_delay_turns: int = 40
    """Largest number of scans in turns that a delay rests on. More tell more and take longer."""
    sigmas: float = 3.0
    """Another time than the file's is believed if it makes scans sharper by at least this number of standard
    deviations. A larger value believes the file more often."""
