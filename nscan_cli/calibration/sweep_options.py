"""The parameters of what scans tell of the turn of their laser."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class SweepTimeOptions:
    """How the time of a turn is measured, with its standard deviation."""

    scans: int = 480
    """Scans, evenly spread, among which turns of the robot are looked for. More find more and take longer."""
    most_rows: int = 240
    """Of these, most that pairs begin with: those where the robot turns fastest. More take longer."""
    pairs: int = 60
    """Most pairs of scans that are matched. More tell more and take longer."""
    max_beams: int = 360
    """Beams of a scan that are matched, evenly spread, are about so many. More tell more and take longer."""
    reach: float = 1.4
    """Times up to so many longest turns are tried, in both directions: the best one is not at an end."""
    step: float = 0.1
    """Distance of the times that are tried, in longest turns. A smaller value takes longer."""
    fitted: int = 3
    """So many times on both sides of the best one are fitted by a parabola. More are less like one."""
    max_change: float = 0.3
    """The robot turns steadily if its rate before and after a scan differs by less than this share. With a
    smaller value fewer pairs are left, with a larger one the time comes out too long."""
    slow: float = 0.1
    """Of a slower turn its rate may change by as much as of one at this rate, rad/s."""
    min_steady: int = 30
    """With fewer pairs of scans in steady turns, those in others are used too."""
    cap: float = 0.6
    """Matches slip: no energy counts as more than this share of the median depth of all pairs, above the
    least one of its pair. With a smaller share fewer times beside the best one count."""
    unsteadiness: float = 0.03
    """Standard deviation that uneven turns add, as a share of the time. A larger value believes the file more
    often."""
    sigmas: float = 3.0
    """A time that is nearer to another one, in standard deviations, is that one. A larger value believes the
    file more often."""


@dataclass(frozen=True)
class SweepCheckOptions:
    """How the time of a laser's turn is taken from its scans."""

    scans: int = 240
    """Scans, evenly spread, among which turns are looked for. More find more, and take longer."""
    scans_apart: int = 2
    """No more than one in so many scans is measured. A larger value takes less time in short logs."""
    min_scans: int = 30
    """Least number of scans of a log that is asked. A larger value believes short logs."""
    pairs: int = 24
    """Most pairs of scans that are compared, those where the robot turns fastest. More tell more and take
    longer."""
    least_pairs: int = 5
    """No fewer pairs say that the file is right. More take longer where it is."""
    settled_sigmas: float = 1.5
    """No more pairs are compared once the file's time makes scans sharper than the others by so many standard
    deviations. A larger value takes longer."""
    shifts: tuple[int, ...] = (-2, 2, -4, 4, -7, 7)
    """Scans from the first of a pair to the second: the robot has to move otherwise there, and to see the
    same."""
    longest_step: float = 0.4
    """Longest time from a scan to the next, s, over which motion is measured."""
    max_apart: float = 0.6
    """Scans of a pair are turned against each other by less than this, rad. A larger value finds more pairs,
    of which some do not match."""
    min_winding: float = math.radians(2.5)
    """Least turn of the robot during a turn of the laser, and least difference of two such turns, rad. A
    larger value tells more of each pair, and finds fewer."""
    min_view: float = math.radians(190.0)
    """Least field of view of a laser that is thought to turn though its file does not say so, rad. With a
    smaller value lasers that look ahead are asked too, which takes time."""
    shortest: float = 0.012
    """Shortest time from scan to scan of such a laser, s. A smaller value asks more lasers."""
    longest: float = 0.5
    """Longest time from scan to scan of such a laser, s. A larger value asks more lasers."""
    time: SweepTimeOptions = field(default_factory=SweepTimeOptions)
    """How its time is measured if the file has none."""
    longest_delay: float = 0.4
    """Longest delay of odometry that is looked for, s. A larger value takes longer."""
    delay_step: float = 0.01
    """Distance of the delays that are tried, s. A smaller value takes longer."""
    delays_fitted: int = 3
    """So many delays on both sides of the best one are fitted by a parabola. More are less like one."""
    least_delay: float = 0.03
    """A shorter delay of odometry is none, s. A larger value leaves the file as it is more often."""
    delay_gain: float = 0.75
    """With the delay the turns have to disagree by no more than this share of what they do without. A larger
    value finds delays more often, also where there is none."""
    stamp_tolerance: float = 0.25
    """Scans are stamped at another beam than the file says if that explains the delay of odometry to within
    this share of the time between two such beams. A larger value blames the stamps more often, and the clock
    of odometry less."""
    min_delay_turns: int = 15
    """Least number of scans in turns that a delay rests on."""
    max_delay_turns: int = 40
    """Most of them. More tell more and take longer."""
    sigmas: float = 3.0
    """By so many standard deviations another time than the file's has to make scans sharper to be believed. A
    larger value believes the file more often."""
