"""The numbers in the lines of a text log, parsed many lines at a time."""

from __future__ import annotations

import io
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

LINES_AT_ONCE = 1024
"""Lines whose numbers are parsed together."""
KERNEL_MIN_BYTES = 1 << 16
"""Bytes of text from which a kernel parses it. Loading the kernel takes longer than parsing less."""
MAX_ANGLE = 720.0
"""rad or degrees; a record with a larger direction or step is damaged."""
MAX_DECIMAL_PLACES = 22
MAX_SIGNIFICAND = 2**53 // 10
"""The largest whole number to which another digit can be appended below 2⁵³."""
TAB, RETURN, SPACE, PLUS, MINUS, POINT, ZERO, NINE = b"\t\r +-.09"


@dataclass(slots=True)
class LineRecord:
    """The values of one line as text."""

    line: int
    """Line number in the file, from 1."""
    values: bytes
    """The values, separated by single spaces."""
    count: int
    """Number of values."""
    stamp: str
    """The time stamp as written; empty if the line has none."""
    host: bytes = b""
    """The computer that wrote the line, as far as the form names it."""

    @classmethod
    def from_payload(cls, line: int, payload: bytes, stamp: str) -> LineRecord:
        """The record of a line whose values are the payload."""
        values = b" ".join(payload.split())
        return cls(line, values, values.count(b" ") + 1 if values else 0, stamp)


class Block(NamedTuple):
    """R successive records with the same numbers of beams and values."""

    records: list[LineRecord]
    """The R records."""
    beams: int
    """Number of beams of each record."""
    values: Array
    """(R, V) values of each record."""


def record_lines(data: bytes, comments: bytes = b"#") -> Iterator[tuple[int, bytes]]:
    """The lines of a log and their numbers, from 1, but for blank lines and those that begin with `comments`.

    Blanks at both ends are left out.
    """
    for number, line in enumerate(io.BytesIO(data), 1):
        text = line.strip()
        if text and text[0] not in comments:
            yield number, text


def parsed(records: list[tuple[LineRecord, int]], skips: Skips) -> Iterator[tuple[LineRecord, int, Array]]:
    """Each record with its number of beams and its values; records with other text are skipped."""
    for block in blocks(records, skips):
        for record, values in zip(block.records, block.values, strict=True):
            yield record, block.beams, values


def blocks(records: list[tuple[LineRecord, int]], skips: Skips) -> Iterator[Block]:
    """The values of (record, number of beams), in blocks; records with other text are skipped."""
    for begin in range(0, len(records), LINES_AT_ONCE):
        part = records[begin : begin + LINES_AT_ONCE]
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


def parsed_poses(records: list[LineRecord], counts: tuple[int, ...], skips: Skips) -> tuple[Array, list[str]]:
    """Poses (R, 3) and time stamps of records that begin with x, y and θ.

    Records whose number of values is not in `counts`, or with a value out of bounds, are skipped.
    """
    rows, stamps = [], []
    for record, _, values in parsed([(record, 0) for record in records], skips):
        if values.size not in counts:
            skips.add("wrong number of values", record.line)
        elif not within_bounds(values):
            skips.add("a value is out of bounds", record.line)
        else:
            rows.append(values[:3])
            stamps.append(record.stamp)
    return np.array(rows, dtype=np.float64).reshape(-1, 3), stamps


def floats(text: bytes) -> Array | None:
    """The numbers of a text separated by blanks, or None if it contains anything else."""
    if len(text) >= KERNEL_MIN_BYTES and runtime_is_loaded():
        values = np.empty(len(text) // 2 + 1)
        count = _plain_decimals(np.frombuffer(text, dtype=np.uint8), values)
        if count >= 0:
            return values[:count]
    with warnings.catch_warnings():
        # Some versions of NumPy warn if they stop early, later ones raise ValueError.
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


@kernel
def _plain_decimals(text: NDArray[np.uint8], values: Array) -> int:
    """Write the numbers of a text to `values`. Returns their number, or −1 if one is no plain decimal.

    A plain decimal has no exponent, a significand below 2⁵³ and at most 22 decimal places. Significand and
    power of ten are then exact, so that their quotient is correctly rounded (W. Clinger, "How to Read
    Floating Point Numbers Accurately", PLDI 1990).
    """
    powers = np.ones(MAX_DECIMAL_PLACES + 1)
    for k in range(MAX_DECIMAL_PLACES):
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
            if ZERO <= text[at] <= NINE and whole < MAX_SIGNIFICAND:
                whole = 10 * whole + int(text[at] - ZERO)
            elif text[at] == POINT and point < 0:
                point = at
            else:
                break
            at += 1
        places = at - point - 1 if point >= 0 else 0
        digits = at - begin - (point >= 0)
        ends = at == len(text) or _is_blank(text[at])
        if digits == 0 or places > MAX_DECIMAL_PLACES or not ends:
            return -1
        value = whole / powers[places]
        values[count] = -value if negative else value
        count += 1
    return count


@leaf_kernel
def _is_blank(byte: int) -> bool:
    return byte == SPACE or TAB <= byte <= RETURN


def beam_count(token: bytes, line: int, skips: Skips) -> int | None:
    """The beam count of a record; None if it is not valid, and the record is skipped."""
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
    """Why a scan cannot have this number of beams; empty if it can."""
    most = BEAMS.value
    return "" if 0 < beams <= most else f"the beam count is not in 1…{most:.0f}"


def within_bounds(values: ArrayLike) -> bool:
    """Whether all values are finite and within the bounds of poses and angles."""
    return bool(rows_within_bounds(np.reshape(values, (1, -1)))[0])


def rows_within_bounds(values: Array) -> NDArray[np.bool_]:
    """(R,) within_bounds of each row of the values (R, V)."""
    found: NDArray[np.bool_] = np.all(np.abs(values) < DISTANCE.value, axis=1)
    return found


def ascii_text(stamp: bytes) -> str:
    """A time stamp of the log as text."""
    return stamp.decode("ascii", "replace")
