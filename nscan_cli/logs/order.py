"""The time of each scan: from its stamp where that can be trusted, sorted, and cut to what was asked for."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import WrongUsageError
from nscan_cli.limits import TIME
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.poses import Array

NOMINAL_PERIOD = 0.1
"""s between scans whose stamps say nothing."""
STAMP = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""A time in seconds, as text; what else Python takes for a number is none."""


@dataclass(frozen=True)
class Order:
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


def by_time(stamps: list[str]) -> Order:
    """Scans sorted stably by their stamps (one a scan, in file order; empty where there is none).

    Stamps that say nothing (fewer than half of them finite, or fewer than half of them distinct) leave
    the scans in file order with nominal times. A single stamp that is missing or not finite is filled in
    between its neighbours in the file.
    """
    times: Array = np.array([_seconds(stamp) for stamp in stamps], dtype=np.float64)
    good = np.isfinite(times)
    size = len(stamps)
    warnings = []
    if 2 * good.sum() < size or (size > 1 and 2 * np.unique(times[good]).size < size):
        times = np.arange(size, dtype=np.float64) * NOMINAL_PERIOD
        warnings.append(
            f"the time stamps say nothing; scans are taken in file order, {NOMINAL_PERIOD:g} s apart"
        )
        texts = [f"{time:.6f}" for time in times]
        return Order(np.arange(size), times, texts, 0, True, warnings)
    texts = list(stamps)
    if not good.all():
        at = np.arange(size)
        times[~good] = np.interp(at[~good], at[good], times[good])
        for row in np.flatnonzero(~good):
            texts[row] = f"{times[row]:.6f}"
        warnings.append(f"{np.sum(~good)} scans have no usable time stamp; it was filled in between others")
    backward = int(np.sum(np.diff(times) < 0))
    if backward:
        warnings.append(f"{backward} time stamps step back; the scans are sorted by time")
    rows = np.argsort(times, kind="stable")
    return Order(rows, times[rows], [texts[row] for row in rows], backward, False, warnings)


def selection(times: Array, options: ReadingOptions, file: str) -> NDArray[np.int64]:
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
    seconds = float(stamp) if STAMP.fullmatch(stamp) else np.nan
    return seconds if abs(seconds) <= TIME.value else np.nan
