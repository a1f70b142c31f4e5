"""Player text, line by line: which devices there are, and the numbers in their records.

Source of the form: Player, server/drivers/shell/writelog.cc. Version 1: `server_time host port interface
index data_time payload`. Version 2: `time host robot interface index type subtype payload`. Logs of 2002,
here version 0, are older than that file: `interface index time payload`. Lengths in m, angles in rad; lines
that begin with # are comments.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nscan_cli.files.limits import RECORD_KINDS
from nscan_cli.logs.assemble import RawScans, scan_table
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import player_bearings
from nscan_cli.logs.text.line_records import LineRecord, ascii_text, beam_count, parsed, within_bounds
from nscan_cli.poses import Array

Version = Literal[0, 1, 2]
Line = tuple[int, bytes, bytes]
"""Number in the file (from 1), time stamp, payload."""
Lines = dict[tuple[str, str], list[Line]]
"""By device, as in laser:0, and by type and subtype, as in 1:1; these are empty in version 1."""
PLACES: dict[Version, tuple[int, int, int]] = {0: (3, 0, 2), 1: (6, 3, 5), 2: (7, 3, 0)}
"""How many fields go before the payload, and which of them the interface and the time stamp are."""
ANGLES: dict[Version, slice] = {0: slice(-4, -1), 1: slice(-4, -1), 2: slice(-5, -2)}
"""Where first and last direction and step stand in what goes before the ranges."""
FEWEST = 3
"""Values of a pose."""
LONGEST_NUMBER = 10
"""Digits of an index or a type."""
INTERFACE = re.compile(rb"[a-z]\w*\Z")


@dataclass(frozen=True)
class PlayerScans:
    """The scans of one laser, in file order."""

    raw: RawScans
    robot: Array | None
    """(S, 3) pose of the robot in the scans of form 1:2, when all have one."""
    bearings: str | None = None
    """Their unit, when the log writes one for each beam."""


def lines_by_device(data: bytes, version: Version, skips: Skips) -> Lines:
    """The lines of a log by device and kind, in file order.

    A device is named `interface:index`, with `robot:` (version 1: `port:`) in front where the log has
    several robots, and `host:` where it has several hosts.
    """
    fields, at, time = PLACES[version]
    found: dict[tuple[bytes, bytes, bytes, bytes, bytes], list[Line]] = {}
    for number, line in enumerate(io.BytesIO(data), 1):
        text = line.strip()
        if not text or text.startswith(b"#"):
            continue
        parts = text.split(None, fields)
        if len(parts) < fields or not INTERFACE.match(parts[at]) or _number(parts[at + 1]) < 0:
            skips.add("not a Player record", number)
            continue
        payload = parts[fields] if len(parts) > fields else b""
        kind = b"%d:%d" % (_number(parts[5]), _number(parts[6])) if version == 2 else b""
        host, robot = parts[1:3] if version else (b"", b"")
        stamp = parts[time]
        key = (host, robot, parts[at], parts[at + 1], kind)
        if key not in found and len(found) >= RECORD_KINDS.value:
            skips.add("a device too many", number)
            continue
        found.setdefault(key, []).append((number, stamp, payload))
    hosts, robots = ({key[at] for key in found} for at in (0, 1))
    lines: Lines = {}
    for (host, robot, interface, index, kind), rows in found.items():
        parts = [interface, b"%d" % int(index)]
        if len(robots) > 1 or len(hosts) > 1:
            parts.insert(0, robot)
        if len(hosts) > 1:
            parts.insert(0, host)
        lines.setdefault((ascii_text(b":".join(parts)), ascii_text(kind)), []).extend(rows)
    return lines


def poses(lines: list[Line], skips: Skips) -> tuple[Array, list[str]]:
    """Rows (R, V), of which x, y and θ are the first three, with stamps; malformed ones are skipped.

    How many values there are depends on the version and on the device: as many as most of the lines have.
    """
    counts = Counter(len(payload.split()) for _, _, payload in lines)
    (usual, _), *_ = counts.most_common(1) or [(0, 0)]
    return numbers(lines, max(usual, FEWEST), skips)


def numbers(lines: list[Line], count: int, skips: Skips) -> tuple[Array, list[str]]:
    """Rows (R, count) of a short record such as a geometry, with stamps; malformed ones are skipped."""
    rows, stamps = [], []
    for record, _, values in parsed([(_record(line), 0) for line in lines], skips):
        if values.size != count:
            skips.add("wrong number of values", record.line)
        elif not within_bounds(values):
            skips.add("a value is out of bounds", record.line)
        else:
            rows.append(values)
            stamps.append(record.stamp)
    return np.array(rows, dtype=np.float64).reshape(-1, count), stamps


def player_scans(laser: str, lines: Lines, version: Version, skips: Skips) -> PlayerScans:
    """The scans of one laser; malformed ones are skipped.

    Version 1: `min max step count`, version 2: `id min max step farthest count`, and in its form 1:2 the
    robot's pose after the id; then a range and an intensity for each beam. Or nothing but a range, a bearing
    and an intensity for each beam, as before version 1 and in some logs of that version.
    """
    if version < 2:
        unnamed = [_record(line) for line in lines.get((laser, ""), [])]
        if player_bearings.have_bearings(unnamed, headed=version == 1):
            raw, unit = player_bearings.bearing_scans(unnamed, skips)
            return PlayerScans(raw, None, unit)
    forms = (("1:1", 6), ("1:2", 9)) if version == 2 else (("", 4),)
    rows: list[tuple[LineRecord, Array, Array]] = []
    for kind, head in forms:
        found = lines.get((laser, kind), [])
        records = [whole for line in found if (whole := _scan_record(line, head, skips)) is not None]
        for record, _, values in parsed(records, skips):
            if not _possible(values[:head], version):
                skips.add("an angle or a pose is out of bounds", record.line)
            else:
                rows.append((record, values[:head], values[head::2]))
    rows.sort(key=lambda row: row[0].line)
    heads = [head for _, head, _ in rows]
    posed = bool(heads) and all(len(head) == 9 for head in heads)
    angles = np.array([head[ANGLES[version]] for head in heads]).reshape(-1, 3)
    if version < 2:
        # Player 1 has hundredths of a degree inside; old files round them to 4 digits of a radian.
        angles = np.radians(np.round(np.degrees(angles), 2))
    farthest = 0.0 if version < 2 or not heads else max(float(head[-2]) for head in heads)
    named = ((farthest, f"the greatest range in {laser}"),) if farthest > 0 else ()
    raw = RawScans(
        scan_table([readings for _, _, readings in rows]),
        angles[:, 0],
        angles[:, 2],
        [record.stamp for record, _, _ in rows],
        (0.0, max(farthest, CARMEN_MAX_RANGE)),
        ("none in a Player log", "assumed, as for CARMEN"),
        named,
        angles[:, 1],
        np.array([len(readings) for _, _, readings in rows], dtype=np.int64),
    )
    return PlayerScans(raw, np.array([head[1:4] for head in heads]) if posed else None)


def _number(text: bytes) -> int:
    """A small number; -1 where there is none."""
    return int(text) if text.isdigit() and len(text) < LONGEST_NUMBER else -1


def _record(line: Line) -> LineRecord:
    number, stamp, payload = line
    values = b" ".join(payload.split())
    return LineRecord(number, values, values.count(b" ") + 1 if values else 0, ascii_text(stamp))


def _scan_record(line: Line, head: int, skips: Skips) -> tuple[LineRecord, int] | None:
    """A scan's record and number of beams, or None when it has fewer values than these need."""
    record = _record(line)
    start = record.values.split(b" ", head)
    if len(start) < head:
        skips.add("wrong number of values", record.line)
        return None
    beams = beam_count(start[head - 1], record.line, skips)
    if beams is None:
        return None
    if record.count != head + 2 * beams:
        skips.add("wrong number of values", record.line)
        return None
    return record, beams


def _possible(head: Array, version: Version) -> bool:
    """Whether what stands before the ranges can be true: angles, step, pose."""
    angles = head[ANGLES[version]]
    return within_bounds(head) and bool(np.abs(angles).max() <= 4 * np.pi) and angles[2] != 0
