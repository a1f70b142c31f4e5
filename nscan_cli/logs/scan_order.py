"""The time of each scan, from its stamp if that is plausible; the order in time; the selection of scans."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.limits import TIME
from nscan_cli.files.text import counted
from nscan_cli.logs.copies import come_equally_often, repeat_reading
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.shared_stamps import spread_stamps
from nscan_cli.logs.stamp_unit import stamp_unit
from nscan_cli.poses import Array, Indices

STAMP = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""A time in seconds as text. Other texts that float() accepts, such as 1_0, are none."""


@dataclass(frozen=True)
class ScanOrderOptions:
    """When stamps are unusable, and when a clock was set back."""

    nominal_period: float = 0.1
    """Time between scans without usable stamps, s. A larger value makes the robot slower."""
    min_alternations: int = 20
    """A clock was set back only if scans from before and after the step back alternate at least this often
    when sorted by time, and only if the step is longer than that number of scan periods: messages that arrive
    late fill a gap instead. A larger value finds fewer such clocks."""
    max_steps_back: int = 20
    """With more steps back, the lines are out of order, and no clock was set back. A larger value finds more
    such clocks."""
    longest_first_step: float = 1.0
    """A stamp of 0 is that of a simulated clock if the next one follows within this time, or within the
    longest other step, s; else it was never set. A larger value believes more of them."""
    longest_absence: float = 86_400.0
    """A clock was also set back where all later stamps lie by more than this before the earlier ones, s: no
    drive lasts so long. There are at least `min_alternations` of both. A larger value finds fewer such
    clocks."""
    min_regular_share: float = 0.8
    """A laser is read more often than it measures if at least this share of its scans are repeated equally
    often. A larger value leaves more repeated scans in the log."""
    min_repeated_scans: int = 20
    """And at least so many scans repeat the one before: fewer can by chance. A larger value finds it in
    longer logs only."""
    longest_pause: float = 60.0
    """Longest pause between two files of one recording, s: a recorder that splits goes on at once. A larger
    value joins more files."""


@dataclass(frozen=True)
class ScanOrder:
    """The scans of a log in order of time."""

    rows: NDArray[np.int64]
    """(S,) positions in the file of the scans in order of time, without copies"""
    times: Array
    """(S,) times in order, s"""
    stamps: list[str]
    """S time stamps in order of time, as written in the source unless the times are nominal"""
    backward: int
    """Number of steps back in time in file order"""
    nominal: bool
    """Whether the stamps are unusable and the times made up"""
    warnings: list[str]
    shared: bool = False
    """Whether scans shared stamps, and their times are made up between these"""

    @property
    def is_measured(self) -> bool:
        """Whether each scan has its own time."""
        return not self.nominal and not self.shared


def scans_by_time(
    stamps: list[str], ranges: NDArray[np.float32], options: ScanOrderOptions = ScanOrderOptions()
) -> ScanOrder:
    """Scans sorted by their stamps, with readings (S, B), without those that repeat the one before.

    A driver or a recorder has sent these again: with the same stamp, or at a higher rate than that of the
    laser, all of them equally often.
    """
    repeats = repeat_reading(ranges)
    rows = np.flatnonzero(repeats)
    is_rate = come_equally_often(repeats, options.min_regular_share)
    if not is_rate or len(rows) < options.min_repeated_scans:
        repeats[rows] = [stamps[row] == stamps[row - 1] for row in rows.tolist()]
    if repeats.any():
        kept = np.flatnonzero(~repeats)
        order = by_time([stamps[row] for row in kept.tolist()], options)
        # Without times, scans that are alike are of a robot that stands.
        if not order.nominal and len(kept) > 1:
            said = f"{counted(int(repeats.sum()), 'scan')} with the readings of the one before: left out"
            return replace(order, rows=kept[order.rows], warnings=[said, *order.warnings])
    return by_time(stamps, options)


def by_time(stamps: list[str], options: ScanOrderOptions = ScanOrderOptions()) -> ScanOrder:
    """The scans sorted stably by their stamps, one per scan in file order, empty if there is none.

    If fewer than half of the stamps are finite, or fewer than half are distinct, the scans stay in file order
    with nominal times. Otherwise stamps in another unit are converted to seconds, a missing stamp is
    interpolated between its neighbours in the file, and scans that share a stamp are spread up to the next
    one.
    """
    written: Array = np.array([_seconds(stamp) for stamp in stamps], dtype=np.float64)
    unit = stamp_unit(written)
    if unit is not None:
        written *= unit.seconds
    written[np.abs(written) > TIME.value] = np.nan
    times = spread_stamps(written)
    good = np.isfinite(times)
    size = len(stamps)
    warnings = []
    if 2 * good.sum() < size or (size > 1 and 2 * np.unique(times[good]).size < size):
        times = np.arange(size, dtype=np.float64) * options.nominal_period
        warnings.append(
            f"the time stamps are unusable; scans are read in file order, {options.nominal_period:g} s apart"
        )
        texts = [f"{time:.6f}" for time in times]
        return ScanOrder(np.arange(size), times, texts, 0, True, warnings)
    is_new = np.full(size, unit is not None)
    if unit is not None:
        warnings.append(f"the time stamps are in {unit.name}: they are multiplied by {unit.seconds:g}")
    is_moved = good & (times != written)
    if is_moved.any():
        warnings.append(
            f"{counted(int(is_moved.sum()), 'scan')} with the time stamp of the scan before: they are spread "
            "evenly up to the next stamp"
        )
    if not good.all():
        places = np.arange(size)
        times[~good] = np.interp(places[~good], places[good], times[good])
        warnings.append(
            f"{counted(int(np.sum(~good)), 'scan')} without a usable time stamp: interpolated between others"
        )
    is_new |= is_moved | ~good
    for since, by in _set_back(times, options):
        times[since:] += by
        is_new[since:] = True
        warnings.append(
            f"the clock was set back by {by:.1f} s at scan {since}; later times are shifted to continue"
        )
    backward = int(np.sum(np.diff(times) < 0))
    if backward:
        warnings.append(f"{counted(backward, 'step')} back in time; the scans are sorted by time")
    rows = np.argsort(times, kind="stable")
    texts = [f"{times[row]:.6f}" if is_new[row] else stamps[row] for row in rows]
    return ScanOrder(rows, times[rows], texts, backward, False, warnings, bool(is_moved.any()))


def _set_back(times: Array, options: ScanOrderOptions) -> list[tuple[int, float]]:
    """Positions in the file at which the clock was set back, and the times (s) to add from there on."""
    if len(times) < 2:
        return []
    times, found = times.copy(), []
    period = float(np.median(np.abs(np.diff(times))))
    steps = np.flatnonzero(np.diff(times) < -options.min_alternations * period) + 1
    for at in steps.tolist() if len(steps) <= options.max_steps_back else ():
        latest = float(times[:at].max())
        caught_up = times[at:] > latest
        until = at + (int(np.argmax(caught_up)) if caught_up.any() else len(caught_up))
        is_behind = np.argsort(times[:until], kind="stable") >= at
        is_apart = times[at:].max() + options.longest_absence < times[:at].min()
        is_apart &= min(at, len(times) - at) >= options.min_alternations
        if is_apart or np.count_nonzero(np.diff(is_behind)) >= options.min_alternations:
            by = latest + period - float(times[at])
            times[at:] += by
            found.append((at, by))
    return found


def usual_period(times: Array) -> float:
    """The median time from one of the times (n,), in order, to the next, s; 0 if all are equal."""
    periods = np.diff(times)
    periods = periods[periods > 0.0]
    return float(np.median(periods)) if len(periods) else 0.0


def nearest_in_time(times: Array, wanted: Array) -> Indices:
    """The rows (M,) of `times` (N,), not decreasing, nearest to `wanted` (M,); of two as near the earlier."""
    right = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(times) - 1)
    return np.where(wanted - times[left] <= times[right] - wanted, left, right).astype(np.int64)


def selected_numbers(times: Array, options: ReadingOptions, file: str) -> NDArray[np.int64]:
    """The numbers of the scans that start, end and every select. Raises WrongUsageError if there is none."""
    since = times - times[0]
    kept = np.ones(len(times), dtype=bool)
    if options.start is not None:
        kept &= since >= options.start
    if options.end is not None:
        kept &= since <= options.end
    numbers = np.flatnonzero(kept)[:: options.every]
    if numbers.size == 0:
        raise WrongUsageError(f"{file}: --start and --end leave no scan; the log lasts {since[-1]:.1f} s")
    return numbers


def _seconds(stamp: str) -> float:
    return float(stamp) if STAMP.fullmatch(stamp) else np.nan
