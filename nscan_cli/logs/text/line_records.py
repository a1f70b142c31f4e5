"""Records of a text log, a line each: the numbers in them, parsed many lines at a time."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nscan_cli.files.limits import BEAMS, DISTANCE
from nscan_cli.kernels.decorators import kernel, leaf_kernel, runtime_is_loaded
from nscan_cli.logs.skips import Skips
from nscan_cli.poses import Array

CHUNK = 1024
LONG = 1 << 16
"""FileBytes; to load a kernel for less takes longer than the work."""
MOST_PLACES = 22
LARGEST_WHOLE = 2**53 // 10
TAB, RETURN, SPACE, PLUS, MINUS, POINT, ZERO, NINE = b"\t\r +-.09"


@dataclass(slots=True)
class LineRecord:
    """One line: its number in the file (from 1), the values as text, and when and where it is from."""

    line: int
    values: bytes
    count: int
    """How many values."""
    stamp: str
    """The time stamp as written; empty when the line has none."""
    host: bytes = b""


class Block(NamedTuple):
    """Records that follow each other, with as many beams and values each."""

    records: list[LineRecord]
    """R"""
    beams: int
    values: Array
    """(R, V)"""


def parsed(records: list[tuple[LineRecord, int]], skips: Skips) -> Iterator[tuple[LineRecord, int, Array]]:
    """Each record with its number of beams and its values; those that are no numbers are skipped."""
    for block in blocks(records, skips):
        for record, values in zip(block.records, block.values, strict=True):
            yield record, block.beams, values


def blocks(records: list[tuple[LineRecord, int]], skips: Skips) -> Iterator[Block]:
    """The values of records with their numbers of beams; those that are no numbers are skipped."""
    for begin in range(0, len(records), CHUNK):
        part = records[begin : begin + CHUNK]
        values = floats(b" ".join(record.values for record, _ in part))
        if values is not None and values.size == sum(record.count for record, _ in part):
            at = 0
            for (beams, count), group in itertools.groupby(part, _layout):
                same = [record for record, _ in group]
                end = at + count * len(same)
                yield Block(same, beams, values[at:end].reshape(len(same), count))
                at = end
            continue
        for record, beams in part:
            alone = floats(record.values)
            if alone is None or alone.size != record.count:
                skips.add("a value is not a number", record.line)
            else:
                yield Block([record], beams, alone[None])


def _layout(record: tuple[LineRecord, int]) -> tuple[int, int]:
    return record[1], record[0].count


def floats(text: bytes) -> Array | None:
    """All numbers of a text separated by blanks, or None when something else is among them."""
    if len(text) >= LONG and runtime_is_loaded():
        values = np.empty(len(text) // 2 + 1)
        count = _plain_decimals(np.frombuffer(text, dtype=np.uint8), values)
        if count >= 0:
            return values[:count]
    with warnings.catch_warnings():
        # NumPy warns where it stops early; a later one raises ValueError.
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


@kernel
def _plain_decimals(text: NDArray[np.uint8], values: Array) -> int:
    """Write the numbers of a text to `values`: how many, or −1 where it has others than plain decimals.

    Both a whole number below 2⁵³ and a power of ten up to 10²² are exact, so that their quotient is the
    nearest there is (W. Clinger, "How to Read Floating Point Numbers Accurately", PLDI 1990). Exponents are
    not plain, and neither are more digits.
    """
    powers = np.ones(MOST_PLACES + 1)
    for k in range(MOST_PLACES):
        powers[k + 1] = 10.0 * powers[k]
    count = at = 0
    while at < len(text):
        if _is_blank(text[at]):
            at += 1
            continue
        negative = text[at] == MINUS
        at += negative or text[at] == PLUS
        whole, point = 0, -1
        begin = at
        while at < len(text):
            if ZERO <= text[at] <= NINE and whole < LARGEST_WHOLE:
                whole = 10 * whole + int(text[at] - ZERO)
            elif text[at] == POINT and point < 0:
                point = at
            else:
                break
            at += 1
        places = at - point - 1 if point >= 0 else 0
        digits = at - begin - (point >= 0)
        ends = at == len(text) or _is_blank(text[at])
        if digits == 0 or places > MOST_PLACES or not ends:
            return -1
        value = whole / powers[places]
        values[count] = -value if negative else value
        count += 1
    return count


@leaf_kernel
def _is_blank(byte: int) -> bool:
    return byte == SPACE or TAB <= byte <= RETURN


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


def within_bounds(values: ArrayLike) -> bool:
    """Whether all values are finite and of a size that a pose or an angle can have."""
    return bool(rows_within_bounds(np.reshape(values, (1, -1)))[0])


def rows_within_bounds(values: Array) -> NDArray[np.bool_]:
    """(R,) the same of each row of the values (R, V)."""
    found: NDArray[np.bool_] = np.all(np.abs(values) < DISTANCE.value, axis=1)
    return found


def ascii_text(stamp: bytes) -> str:
    """A time stamp as it is written in the log."""
    return stamp.decode("ascii", "replace")
