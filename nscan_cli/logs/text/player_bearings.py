"""Laser records of Player logs with a range, a bearing and an intensity for each beam, and no header.

Logs of 2002, older than Player's writelog.cc, have them, and so do some logs of version 1.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE
from nscan_cli.logs.raw_scans import RawScans, empty_scan_table
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text.bearings import EvenBearings, are_degrees, even_bearings
from nscan_cli.logs.text.line_records import LineRecord, beams_problem, parsed, within_bounds
from nscan_cli.logs.text.text_log_options import TextLogOptions
from nscan_cli.poses import Array

VALUES_PER_BEAM = 3
MAX_DIGITS = 10
"""An index, type or beam count of a Player record has fewer digits."""


class BearingScan(NamedTuple):
    """A scan as it is in its line."""

    record: LineRecord
    ranges: Array
    """(n,) m"""
    bearings: Array
    """(n,) rad or degrees, as written"""


def have_bearings(records: list[LineRecord], headed: bool) -> bool:
    """Whether these laser records have bearings and no header. `headed`: the version has headers too."""
    if any(map(_has_head, records)):
        return False
    return not headed or any(record.count and record.count % VALUES_PER_BEAM == 0 for record in records)


def bearing_scans(records: list[LineRecord], skips: Skips) -> tuple[RawScans, str]:
    """The scans in file order and the unit of their bearings; malformed records are skipped.

    Raises LimitExceededError.
    """
    rows = _rows(records, skips)
    in_degrees = are_degrees(np.array([np.abs(row.bearings).max() for row in rows]))
    fans: dict[bytes, EvenBearings | None] = {}
    whole: list[tuple[BearingScan, EvenBearings]] = []
    for row in rows:
        key = row.bearings.tobytes()
        if key not in fans:
            fans[key] = even_bearings(row.bearings, in_degrees)
        found = fans[key]
        if found is None:
            skips.add("the bearings are not evenly spaced", row.record.line)
        else:
            whole.append((row, found))
    whole = _not_cut_off(whole, skips)
    raw = RawScans(
        _ranges_by_direction(whole),
        np.array([found.first for _, found in whole]),
        np.array([found.step for _, found in whole]),
        [row.record.stamp for row, _ in whole],
        (0.0, CARMEN_MAX_RANGE),
        ("none in a Player log", "assumed, as for CARMEN"),
        beams=np.array([int(found.places[-1]) + 1 for _, found in whole], dtype=np.int64),
    )
    return raw, "degrees" if in_degrees else "rad"


def _has_head(record: LineRecord) -> bool:
    """Whether it is of version 1: first and last angle, step, count, and two values for each beam."""
    start = record.values.split(b" ", 4)[:4]
    count = start[3] if len(start) == 4 else b""
    return count.isdigit() and len(count) < MAX_DIGITS and 4 + 2 * int(count) == record.count


def _rows(records: list[LineRecord], skips: Skips) -> list[BearingScan]:
    """The scans with valid numbers of values and bearings; other records are skipped."""
    whole = []
    for record in records:
        beams, more = divmod(record.count, VALUES_PER_BEAM)
        problem = "wrong number of values" if more or not beams else beams_problem(beams)
        if problem:
            skips.add(problem, record.line)
        else:
            whole.append((record, beams))
    rows = []
    for record, _, values in parsed(whole, skips):
        bearings = values[1::VALUES_PER_BEAM]
        if not within_bounds(bearings) or np.abs(bearings).max() > TextLogOptions.max_bearing:
            skips.add("a bearing is out of bounds", record.line)
        else:
            rows.append(BearingScan(record, values[::VALUES_PER_BEAM], bearings))
    return rows


def _not_cut_off(
    whole: list[tuple[BearingScan, EvenBearings]], skips: Skips
) -> list[tuple[BearingScan, EvenBearings]]:
    """The scans without those that begin as most do but end earlier: a line has no count of its beams."""
    most_frequent = Counter(
        (found.first, found.step, int(found.places[-1])) for _, found in whole
    ).most_common(1)
    kept = []
    for row, found in whole:
        first, step, last = most_frequent[0][0]
        if found.places[-1] < last and abs(found.first - first) < abs(step) / 2:
            skips.add("fewer beams than the other scans, from the same bearing on", row.record.line)
        else:
            kept.append((row, found))
    return kept


def _ranges_by_direction(whole: list[tuple[BearingScan, EvenBearings]]) -> NDArray[np.float32]:
    """The readings (S, B) by direction; nan if there is none. Raises LimitExceededError."""
    table = empty_scan_table(len(whole), max((int(found.places[-1]) + 1 for _, found in whole), default=0))
    with np.errstate(over="ignore", invalid="ignore"):
        for readings, (row, found) in zip(table, whole, strict=True):
            readings[found.places] = row.ranges
    return table
