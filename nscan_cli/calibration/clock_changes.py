"""A place in a log behind which odometry is late or early, and not before: one of two clocks was set there.

Over the whole log turns then fit at no offset, or at that of the longer part. odometry_delay.py and
clock_offset.py look for one offset of all stamps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.measured_steps import KnownSteps, measure_steps
from nscan_cli.calibration.moved_stamps import with_moved_part
from nscan_cli.calibration.odometry_fault_options import ClockChangeOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.calibration.turn_differences import Turns, turn_differences
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array


class ClockChange(NamedTuple):
    """The place that tells best, and the offsets of odometry's stamps with which turns fit on both sides."""

    time: float
    """The place, s."""
    unsure: tuple[float, float]
    """It may be from the one time to the other, s."""
    before: float
    """s to add to the stamps of odometry before it."""
    behind: float
    """And behind it, s."""
    sigmas: float
    """Mean gain of the turns with the offset of their own side, in its standard deviations, of the side where
    it is less."""
    left: float
    """Sum of the differences of turns with it, as a share of the turns by scans, of the side where it is
    more; each is capped."""
    gain: float
    """This sum as a share of that with the offset of the other side, of the side where it is more."""
    disagreement: float
    """That sum with the offset of the other side, as a share of the turns by scans, of the side where it is
    less."""

    def is_clear(self, sigmas: float, options: ClockChangeOptions) -> bool:
        """Whether both sides tell their own offset, by so many standard deviations."""
        is_told = self.left <= options.max_left and self.gain <= options.max_gain and self.sigmas >= sigmas
        is_told &= self.disagreement >= options.min_disagreement
        return is_told and abs(self.behind - self.before) >= options.least


def checked_clock_change(
    log: LaserLog, known: KnownSteps, options: FileCheckOptions
) -> tuple[LaserLog, list[str]]:
    """The log with its odometry on one clock, and messages.

    More steps are measured only if those that are `known` show a change; they are added.
    """
    if log.odometry is None:
        return log, []
    limits, times = options.clock_change, log.middle_times
    change = clock_change(log, Turns.of_known(known, times), limits, limits.first_turns)
    if change is None or not change.is_clear(limits.first_sigmas, limits):
        return log, []
    rows = telling_steps(log, options.steps, options.more_steps)
    measure_steps(log, rows, options.steps, known=known)
    return with_one_clock(log, Turns.of_known(known, times), limits)


def with_one_clock(log: LaserLog, turns: Turns, options: ClockChangeOptions) -> tuple[LaserLog, list[str]]:
    """The log with its odometry on one clock, by the turns of its scans, and messages."""
    change = clock_change(log, turns, options, options.min_turns)
    if change is None or not change.is_clear(options.sigmas, options):
        return log, []
    by = change.behind - change.before
    # The side that is farther off was set wrongly.
    is_behind = abs(change.behind) > abs(change.before)
    # Where a laser turns, the middle of its last scan is behind all stamps.
    from_here = int(log.numbers[min(int(np.searchsorted(log.times, change.time)), len(log) - 1)])
    side = "early" if (by > 0.0) == is_behind else "late"
    where = f"from about scan {from_here} on" if is_behind else f"up to about scan {from_here}"
    said = (
        f"odometry is stamped {abs(by):.2g} s too {side} {where}, against the rest, by the turns of the "
        "scans: a clock was set there; these stamps are moved; --as-recorded believes the file"
    )
    moved = with_moved_part(log, change.time, by if is_behind else -by, is_behind, change.unsure)
    return moved, [said]


def clock_change(log: LaserLog, turns: Turns, options: ClockChangeOptions, least: int) -> ClockChange | None:
    """The place at which two offsets explain the turns by scans best; None for fewer turns than `least` on
    both sides, of which there are more where more turns are known."""
    at, poses = log.known_odometry()
    begins, ends, turned = turns.of_at_least(options.min_turn)
    least = max(least, min(options.min_turns, len(turned) // 3))
    if len(turned) < 2 * least or len(at) < 2:
        return None
    count = round(options.longest / options.step)
    offsets = options.step * np.arange(-count, count + 1, dtype=np.float64)
    path = at, np.unwrap(poses[:, 2])
    off = np.minimum(turn_differences(path, (begins, ends), turned, offsets), options.max_difference)
    sums = np.cumsum(off, axis=1)
    before, both = sums[:, least - 1 : len(turned) - least], sums[:, -1:]
    k = int(np.argmin(before.min(axis=0) + (both - before).min(axis=0))) + least
    whole = np.minimum(np.abs(turned), options.max_difference)
    totals = [off[:, :k].mean(axis=1), off[:, k:].mean(axis=1)]
    if any(int(total.argmin()) in (0, 2 * count) for total in totals):
        return None
    before_it, behind_it = (parabola_minimum(offsets, total, options.fitted) for total in totals)
    # Between two offsets that were tried, one of them may disagree more than one that only happens to fit.
    found = turn_differences(path, (begins, ends), turned, np.array([before_it, behind_it]))
    of_before, of_behind = np.minimum(found, options.max_difference)
    told = [
        _TurnsOfSide.of(of_before[:k], of_behind[:k], whole[:k]),
        _TurnsOfSide.of(of_behind[k:], of_before[k:], whole[k:]),
    ]
    at_place = 0.5 * float(ends[k - 1] + begins[k])
    sigmas, lefts, gains, disagreements = zip(*told, strict=True)
    beside, most = options.unsure_turns, options.longest_unsure
    unsure = (
        max(float(ends[max(k - 1 - beside, 0)]), at_place - most),
        min(float(begins[min(k + beside, len(begins) - 1)]), at_place + most),
    )
    worst = min(sigmas), max(lefts), max(gains), min(disagreements)
    return ClockChange(at_place, unsure, before_it, behind_it, *worst)


class _TurnsOfSide(NamedTuple):
    """How the turns of one side fit with its own offset; as in ClockChange."""

    sigmas: float
    left: float
    gain: float
    disagreement: float

    @classmethod
    def of(cls, own: Array, other: Array, turns: Array) -> _TurnsOfSide:
        """From the differences (n,) with its offset and with the other side's, and the turns (n,), rad."""
        more = other - own
        sigma = max(float(more.std(ddof=1)), 1e-9) / len(more) ** 0.5
        off, off_there, all_turns = float(own.sum()), float(other.sum()), float(turns.sum())
        gain = off / max(off_there, 1e-9)
        return cls(float(more.mean()) / sigma, off / all_turns, gain, off_there / all_turns)
