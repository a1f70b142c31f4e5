"""The devices of a Player log and the numbers in their records.

Source of the form: Player, server/drivers/shell/writelog.cc. Version 1: `server_time host port interface
index data_time payload`. Version 2: `time host robot interface index type subtype payload`. Logs of 2002,
version 0 here, are older than that file: `interface index time payload`. Lengths are in m, angles in rad.
Lines that begin with # are comments.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nscan_cli.files.limits import RECORD_KINDS
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE
from nscan_cli.logs.raw_scans import RawScans, scan_table
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import player_bearings
from nscan_cli.logs.text.line_records import (
    MAX_ANGLE,
    LineRecord,
    ascii_text,
    beam_count,
    parsed,
    parsed_poses,
    record_lines,
    within_bounds,
)
from nscan_cli.poses import Array

Version = Literal[0, 1, 2]
PayloadLine = tuple[int, bytes, bytes]
"""Line number in the file (from 1), time stamp, payload."""
DeviceLines = dict[tuple[str, str], list[PayloadLine]]
"""Lines by device, such as laser:0, and by type and subtype, such as 1:1, which only version 2 has."""
FIELD_POSITIONS: dict[Version, tuple[int, int, int]] = {0: (3, 0, 2), 1: (6, 3, 5), 2: (7, 3, 0)}
"""Number of fields before the payload, position of the interface, position of the time stamp."""
ANGLES: dict[Version, slice] = {0: slice(-4, -1), 1: slice(-4, -1), 2: slice(-5, -2)}
"""Positions of first direction, last direction and step in the values before the ranges."""
INTERFACE = re.compile(rb"[a-z]\w*\Z")


@dataclass(frozen=True)
class PlayerScans:
    """The scans of one laser, in file order."""

    raw: RawScans
    robot: Array | None
    """(S, 3) pose of the robot if all scans are of form 1:2, else None."""
    bearings: str | None = None
    """Unit of the bearings, if the log writes one for each beam."""


def lines_by_device(data: bytes, version: Version, skips: Skips) -> DeviceLines:
    """The lines of a log by device and kind, in file order.

    A device is named `interface:index`, after `robot:` (version 1: `port:`) if the log has several robots,
    and after `host:robot:` if it has several hosts.
    """
    fields, at, time = FIELD_POSITIONS[version]
    found: dict[tuple[bytes, bytes, bytes, bytes, bytes], list[PayloadLine]] = {}
    for number, text in record_lines(data):
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
            skips.add("too many devices", number)
            continue
        found.setdefault(key, []).append((number, stamp, payload))
    hosts, robots = ({key[at] for key in found} for at in (0, 1))
    lines: DeviceLines = {}
    for (host, robot, interface, index, kind), rows in found.items():
        parts = [interface, b"%d" % int(index)]
        if len(robots) > 1 or len(hosts) > 1:
            parts.insert(0, robot)
        if len(hosts) > 1:
            parts.insert(0, host)
        lines.setdefault((ascii_text(b":".join(parts)), ascii_text(kind)), []).extend(rows)
    return lines


def device_poses(lines: list[PayloadLine], skips: Skips) -> tuple[Array, list[str]]:
    """Poses (R, 3) and stamps of the records of a position device; malformed ones are skipped.

    The number of values depends on the version and the device: the most frequent one is taken as right.
    """
    counts = Counter(len(payload.split()) for _, _, payload in lines)
    (most_frequent, _), *_ = counts.most_common(1) or [(0, 0)]
    return poses_with_size(lines, max(most_frequent, 3), skips)


def poses_with_size(lines: list[PayloadLine], count: int, skips: Skips) -> tuple[Array, list[str]]:
    """Poses (R, 3) and stamps of records with `count` values that begin with a pose; others are skipped."""
    return parsed_poses([_payload_record(line) for line in lines], (count,), skips)


def player_scans(laser: str, lines: DeviceLines, version: Version, skips: Skips) -> PlayerScans:
    """The scans of one laser; malformed ones are skipped.

    Version 1: `min max step count`. Version 2: `id min max step max_range count`, in form 1:2 with the
    robot's pose after the id. A range and an intensity for each beam follow. Before version 1, and in some
    logs of that version, a record has a range, a bearing and an intensity for each beam and nothing else.
    """
    if version < 2:
        unnamed = [_payload_record(line) for line in lines.get((laser, ""), [])]
        if player_bearings.have_bearings(unnamed, headed=version == 1):
            raw, unit = player_bearings.bearing_scans(unnamed, skips)
            return PlayerScans(raw, None, unit)
    forms = (("1:1", 6), ("1:2", 9)) if version == 2 else (("", 4),)
    rows: list[tuple[LineRecord, Array, Array]] = []
    for kind, head in forms:
        found = lines.get((laser, kind), [])
        records = [whole for line in found if (whole := _scan_record(line, head, skips)) is not None]
        for record, _, values in parsed(records, skips):
            if not _is_plausible(values[:head], version):
                skips.add("an angle or a pose is out of bounds", record.line)
            else:
                rows.append((record, values[:head], values[head::2]))
    rows.sort(key=lambda row: row[0].line)
    heads = [head for _, head, _ in rows]
    posed = bool(heads) and all(len(head) == 9 for head in heads)
    angles = np.array([head[ANGLES[version]] for head in heads]).reshape(-1, 3)
    if version < 2:
        # Player 1 has hundredths of a degree internally; its files round them to 4 digits of a radian.
        angles = np.radians(np.round(np.degrees(angles), 2))
    max_range = 0.0 if version < 2 or not heads else max(float(head[-2]) for head in heads)
    named = ((max_range, f"the greatest range in {laser}"),) if max_range > 0 else ()
    raw = RawScans(
        scan_table([readings for _, _, readings in rows]),
        angles[:, 0],
        angles[:, 2],
        [record.stamp for record, _, _ in rows],
        (0.0, max(max_range, CARMEN_MAX_RANGE)),
        ("none in a Player log", "assumed, as for CARMEN"),
        named,
        angles[:, 1],
        np.array([len(readings) for _, _, readings in rows], dtype=np.int64),
    )
    return PlayerScans(raw, np.array([head[1:4] for head in heads]) if posed else None)


def _number(text: bytes) -> int:
    """A small whole number, or −1 if the text is none."""
    return int(text) if text.isdigit() and len(text) < player_bearings.MAX_DIGITS else -1


def _payload_record(line: PayloadLine) -> LineRecord:
    number, stamp, payload = line
    return LineRecord.from_payload(number, payload, ascii_text(stamp))


def _scan_record(line: PayloadLine, head: int, skips: Skips) -> tuple[LineRecord, int] | None:
    """The record of a scan and its number of beams, or None if it has another number of values."""
    record = _payload_record(line)
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


def _is_plausible(head: Array, version: Version) -> bool:
    angles = head[ANGLES[version]]
    return within_bounds(head) and bool(np.abs(angles).max() <= MAX_ANGLE) and angles[2] != 0
