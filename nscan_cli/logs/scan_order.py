"""The time of each scan: from its stamp where that can be trusted, sorted, and cut to what was asked for."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.counting import counted
from nscan_cli.files.limits import TIME
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array

NOMINAL_PERIOD = 0.1
"""s between scans whose stamps say nothing."""
MIXED = 20
"""Sorted by time, the scans before and after a clock was set back alternate so often at least. Messages that
come late fill a gap instead."""
MOST_SET_BACK = 20
"""With more steps back than that, lines are out of order, and the clock is not to blame."""
STAMP = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""A time in seconds, as text; what else Python takes for a number is none."""


@dataclass(frozen=True)
class ScanOrder:
    """The scans of a log in order of time."""

    rows: NDArray[np.int64]
    """(S,) positions in file order of the scans, in order of time."""
    times: Array
    """(S,) seconds, in order of time."""
    stamps: list[str]
    """S, likewise; as the source wrote them, unless the times are nominal."""
    backward: int
    """Steps back in time in file order."""
    nominal: bool
    """The stamps say nothing; the times are made up."""
    warnings: list[str]


def by_time(stamps: list[str]) -> ScanOrder:
    """Scans sorted stably by their stamps (one a scan, in file order; empty where there is none).

    Stamps that say nothing (fewer than half of them finite, or fewer than half of them distinct) leave
    the scans in file order with nominal times. A single stamp that is missing or not finite is filled in
    between its neighbours in the file.
    """
    times: Array = np.array([_seconds(stamp) for stamp in stamps], dtype=np.float64)
    times[np.abs(times) > TIME.value] = np.nan
    good = np.isfinite(times)
    size = len(stamps)
    warnings = []
    if 2 * good.sum() < size or (size > 1 and 2 * np.unique(times[good]).size < size):
        times = np.arange(size, dtype=np.float64) * NOMINAL_PERIOD
        warnings.append(
            f"the time stamps say nothing; scans are taken in file order, {NOMINAL_PERIOD:g} s apart"
        )
        texts = [f"{time:.6f}" for time in times]
        return ScanOrder(np.arange(size), times, texts, 0, True, warnings)
    texts = list(stamps)
    if not good.all():
        places = np.arange(size)
        times[~good] = np.interp(places[~good], places[good], times[good])
        for row in np.flatnonzero(~good):
            texts[row] = f"{times[row]:.6f}"
        warnings.append(
            f"{counted(int(np.sum(~good)), 'scan')} without a usable time stamp: filled in between others"
        )
    for since, by in _set_back(times):
        times[since:] += by
        texts[since:] = [f"{time:.6f}" for time in times[since:]]
        warnings.append(
            f"the clock is set back by {by:.1f} s at scan {since}; the times go on from those before"
        )
    backward = int(np.sum(np.diff(times) < 0))
    if backward:
        warnings.append(f"{counted(backward, 'step')} back in time; the scans are sorted by time")
    rows = np.argsort(times, kind="stable")
    return ScanOrder(rows, times[rows], [texts[row] for row in rows], backward, False, warnings)


def _set_back(times: Array) -> list[tuple[int, float]]:
    """Where (positions in file order) the clock was set back, and by how much (s) to carry the times on."""
    if len(times) < 2:
        return []
    times, found = times.copy(), []
    period = float(np.median(np.abs(np.diff(times))))
    steps = np.flatnonzero(np.diff(times) < -MIXED * period) + 1
    for at in steps.tolist() if len(steps) <= MOST_SET_BACK else ():
        latest = float(times[:at].max())
        caught_up = times[at:] > latest
        until = at + (int(np.argmax(caught_up)) if caught_up.any() else len(caught_up))
        is_behind = np.argsort(times[:until], kind="stable") >= at
        if np.count_nonzero(np.diff(is_behind)) >= MIXED:
            by = latest + period - float(times[at])
            times[at:] += by
            found.append((at, by))
    return found


def selected_numbers(times: Array, options: ReadingOptions, file: str) -> NDArray[np.int64]:
    """Which scans (numbers, in order of time) start, end and every leave.

    Raises WrongUsageError when none is left.
    """
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
