"""Records of a text log, a line each: the numbers in them, parsed many lines at a time."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nscan_cli.limits import BEAMS, DISTANCE
from nscan_cli.logs.skips import Skips
from nscan_cli.poses import Array

CHUNK = 1024


@dataclass(frozen=True)
class Record:
    """One line: its number in the file (from 1), the values as text, and when and where it is from."""

    line: int
    values: bytes
    count: int
    """How many values."""
    stamp: str
    """The time stamp as written; empty when the line has none."""
    host: bytes = b""


def parsed(records: list[tuple[Record, int]], skips: Skips) -> Iterator[tuple[Record, int, Array]]:
    """Each record with its number of beams and its values; those that are no numbers are skipped."""
    for begin in range(0, len(records), CHUNK):
        part = records[begin : begin + CHUNK]
        values = floats(b" ".join(record.values for record, _ in part))
        if values is not None and values.size == sum(record.count for record, _ in part):
            at = 0
            for record, beams in part:
                yield record, beams, values[at : at + record.count]
                at += record.count
            continue
        for record, beams in part:
            alone = floats(record.values)
            if alone is None or alone.size != record.count:
                skips.add("a value is not a number", record.line)
            else:
                yield record, beams, alone


def floats(text: bytes) -> Array | None:
    """All numbers of a text separated by blanks, or None when something else is among them."""
    with warnings.catch_warnings():
        # NumPy warns where it stops early; a later one raises ValueError.
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def beam_count(token: bytes, line: int, skips: Skips) -> int | None:
    """The number of beams that a record names; None, and the record skipped, when it is none."""
    try:
        beams = int(token)
    except ValueError:
        skips.add("the beam count is not a number", line)
        return None
    problem = beams_problem(beams)
    if problem:
        skips.add(problem, line)
        return None
    return beams


def beams_problem(beams: int) -> str:
    """What is wrong with a scan of so many beams; empty when nothing is."""
    most = BEAMS.value
    return "" if 0 < beams <= most else f"the beam count is not in 1…{most:.0f}"


def sound(values: ArrayLike) -> bool:
    """Whether all values are finite and of a size that a pose or an angle can have."""
    return bool((np.abs(values) < DISTANCE.value).all())


def as_text(stamp: bytes) -> str:
    """A time stamp as it is written in the log."""
    return stamp.decode("ascii", "replace")
