"""The parameters of what odometry itself, or a few steps of its scans, show to be wrong with it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class UnsteadyStampOptions:
    """When no offset makes odometry fit the scans, as where their stamps are now early and now late."""

    max_disagreement: float = 0.4
    """Turns fit at no offset if they disagree by more than this share of the turns by scans with the best
    one. It is 0.56 at most on real logs, whose positions fit. A larger value finds less."""
    max_turn_spread: float = 0.2
    """A factor of turns does not explain that if their median residual is at least this share of them. It is
    0.28 at most on real logs. A larger value finds less."""
    max_tail: float = 0.17
    """Positions do not fit, either, if the upper quartile of their residuals is more than this share of the
    motion. It is 0.12 at most on real logs whose turns disagree. A larger value finds less."""
    min_turns: int = 14
    """Least number of steps with a turn, of a sample for the check of a file. A larger value finds less where
    robots seldom turn."""
    min_measured_share: float = 0.8
    """Least share of the steps that scans measure. With a smaller one odometry is left out where it is needed
    most."""


@dataclass(frozen=True)
class ClockChangeOptions:
    """When odometry is late or early in a part of the log, and not in the rest."""

    longest: float = 12.0
    """Largest offset of the stamps that is tried, s. A larger value takes longer."""
    step: float = 0.05
    """Interval between the offsets that are tried, s. A smaller value takes longer."""
    min_turn: float = 0.05
    """Least turn of a step that counts, rad. With a larger value fewer steps count, and each tells more."""
    min_turns: int = 6
    """Least number of steps with a turn on both sides. A larger value finds less near the ends of a log."""
    unsure_turns: int = 2
    """Between so many steps with a turn before the place and behind it odometry is left out. A larger value
    leaves out more, and a smaller one keeps poses on the wrong side."""
    longest_unsure: float = 3.0
    """But only so long before the place, and behind it, s: robots that seldom turn need it. A larger value
    leaves out more."""
    first_turns: int = 4
    """Least number of these among the first few steps. A larger value takes less time, and finds less where
    robots seldom turn."""
    max_difference: float = 0.1
    """Turns of a step that differ by more count as different by this, rad. A larger value gives slips and
    failed matches more weight."""
    least: float = 0.3
    """Least difference of the offsets of both sides, s. It is 0.1 on real logs. A larger value finds less."""
    max_left: float = 0.75
    """Largest disagreement of the turns of a side with its offset, as a share of the turns by scans. A larger
    value finds more, also by chance."""
    max_gain: float = 0.85
    """A side disagrees with its own offset by at most this share of its disagreement with that of the other.
    A larger value finds more, also by chance."""
    min_disagreement: float = 0.1
    """Least disagreement of the turns of a side with the offset of the other, as a share of the turns by
    scans. A turn at a steady rate fits at other times, too, and noise decides where. A larger value finds
    less."""
    first_sigmas: float = 1.3
    """More steps are measured where the first few gain so much on both sides, in standard deviations. A
    larger value takes less time, and finds less."""
    sigmas: float = 3.0
    """Least mean gain of the turns of either side with its own offset, in its standard deviations. A larger
    value finds less."""
    fitted: int = 3
    """Number of offsets on each side of the best one that a parabola fits. With more the curve is less like a
    parabola."""


@dataclass(frozen=True)
class ReversedHeadingOptions:
    """When the headings by odometry count the wrong way, and its positions do not."""

    min_driven: float = 0.02
    """Shortest step from scan to scan that tells which way the robot drives, m. A larger value needs faster
    robots."""
    min_driven_steps: int = 50
    """Least number of these steps. A larger value finds less in short drives."""
    min_agreement: float = 0.7
    """Least length of the mean of the directions of these steps, in the robot's frame, if headings count the
    other way: 1 if it always drives the same way. It is 0.89 to 1 on real logs. A larger value finds less."""
    min_gain: float = 0.3
    """This length must be smaller by so much as recorded. A larger value finds less, where robots drive
    to and fro on one line."""
    min_turns: int = 6
    """Least number of steps with a turn by scans. A larger value finds less in short drives."""
    min_opposite_share: float = 0.75
    """Least share of these whose turn by odometry is opposite. A larger value finds less."""


@dataclass(frozen=True)
class HeadingJumpOptions:
    """When headings by odometry jump, and its positions do not."""

    min_jump: float = 0.1
    """Least jump, rad. A smaller one is left to matching. A larger value finds less."""
    max_jumps: int = 64
    """So many of the largest turns may be jumps. A larger number takes longer."""
    min_driven: float = 0.02
    """Shortest step that tells which way the robot drives, m. A larger value needs faster robots."""
    min_steps: int = 8
    """Least number of these steps before a jump and behind it. A larger value finds less near the ends of a
    log."""
    most_steps: int = 60
    """So many of these steps next to the jump are looked at. With more, other jumps matter."""
    min_agreement: float = 0.8
    """Least length of the mean of their directions, in the robot's frame: 1 if it always drives the same way,
    or to and fro. A larger value finds less."""
    tolerance: float = 0.4
    """The robot turns against the jump in its own frame, to within this share of it. A larger value finds
    more."""
    max_turn: float = 0.4
    """By the scans it turns by at most this share of the jump. A larger value finds more."""


@dataclass(frozen=True)
class ScaledStretchOptions:
    """When the lengths of odometry are multiplied by something from a scan to another."""

    min_factor: float = 2.5
    """Least factor, or its inverse: no wheel slips so much. A larger value finds less."""
    max_usual: float = 1.5
    """Elsewhere the factor is this at most, or its inverse. A larger value finds more."""
    min_length: float = 0.05
    """Least length of a step by scans, m. With a larger value fewer steps count, and each tells more."""
    max_turn: float = 1.5
    """Largest turn of such a step for each metre, rad/m. A larger value lets more steps count, also those
    that tell the place of the laser."""
    max_sigma: float = 0.15
    """Largest standard deviation of such a length, as a share of it. A larger value lets more steps count,
    also those along bare walls."""
    first_steps: int = 3
    """More steps are measured where so many of the first few are off one after another. A larger value
    misses shorter stretches."""
    min_steps: int = 8
    """Least number of steps in a stretch, and outside of all. A larger value finds less."""
    beside: int = 2
    """A step is off if most are of itself and so many on each side. A larger value misses shorter
    stretches."""
    max_spread: float = 0.2
    """Largest median residual of the logarithms of the factors in a stretch. A larger value finds more, also
    where matches fail."""
    max_aside: float = 0.5
    """In a stretch odometry and scans lead the same way as elsewhere, to this angle in the median, rad. A
    larger value finds more, also where odometry stands and trembles."""
    max_unclear: float = 0.3
    """A step tells on which side of an end it is if its scale is off that side's by this share of the
    difference of both at most. A larger value needs fewer steps, and takes those beside an end for clear."""
    decimal_tolerance: float = 0.08
    """A factor this near to a power of ten (relative) is that power. A larger value rounds more factors."""
    bisections: int = 16
    """Number of steps that are measured to find each end of a stretch. More find it more exactly and take
    longer."""
