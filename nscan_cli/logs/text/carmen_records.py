"""The records of a CARMEN log and the numbers in them.

Source of the form: CARMEN, src/logger/writelog.c. A line is `TAG values… ipc_timestamp host
logger_timestamp`; lines that begin with # are comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.limits import RECORD_KINDS
from nscan_cli.logs.raw_scans import empty_scan_table
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text.line_records import (
    MAX_ANGLE,
    Block,
    LineRecord,
    ascii_text,
    beam_count,
    blocks,
    parsed_poses,
    record_lines,
    rows_within_bounds,
)
from nscan_cli.poses import Array

TAG = re.compile(rb"[A-Z][A-Z0-9_]{2,31}\Z")
TAG_WITH_ANGLES = re.compile(r"(RAW|ROBOT)LASER\d\Z")
"""Tags of the newer laser messages, which carry their angles."""
LASER_TAG = re.compile(rb"((RAW|ROBOT)?LASER\d|[FR]LASER)\Z")
TAGS_READ = (b"ODOM", b"TRUEPOS", b"PARAM")
"""Other tags whose records are read."""
ONLY_COUNTED = (0, b"")
"""Placeholder for a line that is only counted."""
POSE_VALUES = 6
"""Number of values of ODOM and TRUEPOS: x, y, θ and three more."""
TRAILER = 3
"""Number of fields after the values: time stamp, host and the logger's time stamp."""
TaggedLines = dict[str, list[tuple[int, bytes]]]
"""Lines (number from 1, bytes without the tag) in file order, by tag."""


@dataclass
class CarmenScans:
    """The scans of one laser, in file order: S scans of at most B beams."""

    ranges: NDArray[np.float32]
    """(S, B) readings as written, m; nan beyond a scan's own beams."""
    beams: NDArray[np.int64]
    """(S,) number of beams."""
    head: Array
    """(S, 7) type, start angle, field of view, resolution, maximum, accuracy and mode of newer messages;
    (S, 0) for older ones."""
    laser: Array
    """(S, 3) pose of the laser in the odometry frame; (S, 0) if the message has none."""
    robot: Array
    """(S, 3) pose of the robot in the odometry frame; (S, 0) if the message has none."""
    stamps: list[str]
    lines: list[int]
    hosts: set[bytes]


def lines_by_tag(data: bytes, skips: Skips) -> TaggedLines:
    """The lines of a log by tag. A line with a tag that is not read is replaced by ONLY_COUNTED."""
    by_tag: dict[bytes, list[tuple[int, bytes]]] = {}
    used: set[bytes] = set()
    for number, text in record_lines(data):
        tag, _, rest = text.partition(b" ")
        if b"\t" in tag:
            tag, rest = [*text.split(None, 1), b""][:2]
        known = by_tag.get(tag)
        if known is None:
            if not TAG.match(tag) or len(by_tag) >= RECORD_KINDS.value:
                skips.add("not a CARMEN record", number)
                continue
            known = by_tag[tag] = []
            if tag in TAGS_READ or LASER_TAG.match(tag):
                used.add(tag)
        known.append((number, rest) if tag in used else ONLY_COUNTED)
    return {tag.decode(): lines for tag, lines in by_tag.items()}


def carmen_poses(lines: list[tuple[int, bytes]], skips: Skips, by_logger: bool) -> tuple[Array, list[str]]:
    """Poses (R, 3) and stamps of ODOM or TRUEPOS records; malformed ones are skipped.

    The stamps are the logger's if `by_logger`.
    """
    records = []
    for number, text in lines:
        tokens = text.split()
        if len(tokens) != POSE_VALUES + TRAILER:
            skips.add("wrong number of values", number)
            continue
        values, stamp = b" ".join(tokens[:POSE_VALUES]), ascii_text(tokens[-1 if by_logger else POSE_VALUES])
        records.append(LineRecord(number, values, POSE_VALUES, stamp))
    return parsed_poses(records, (POSE_VALUES,), skips)


def logger_stamps(lines: list[tuple[int, bytes]], scans: CarmenScans) -> list[str]:
    """The times at which the scans were logged, at the end of their lines; empty without a trailer."""
    ends = dict(lines)
    return [
        ascii_text(ends[line].split()[-1]) if stamp else ""
        for line, stamp in zip(scans.lines, scans.stamps, strict=True)
    ]


def carmen_scans(tag: str, lines: list[tuple[int, bytes]], skips: Skips) -> CarmenScans:
    """The scans of one laser tag; malformed ones are skipped. Raises LimitExceededError."""
    head = 7 if TAG_WITH_ANGLES.match(tag) else 0
    poses = 6 if tag in ("FLASER", "RLASER") or tag.startswith("ROBOT") else 0
    tail = poses + (5 if tag.startswith("ROBOT") else 0)
    counts: dict[bytes, int] = {}
    records = [
        record
        for number, text in lines
        if (record := _laser_record(number, text, head, tail, counts, skips)) is not None
    ]
    widest = max((n for _, n in records), default=0)
    size = len(records)
    result = CarmenScans(
        ranges=empty_scan_table(size, widest),
        beams=np.zeros(size, dtype=np.int64),
        head=np.zeros((size, head)),
        laser=np.zeros((size, poses // 2)),
        robot=np.zeros((size, poses // 2)),
        stamps=[],
        lines=[],
        hosts=set(),
    )
    row = 0
    for block in blocks(records, skips):
        good, values = _plausible_records(block, head, poses, tail, skips)
        rows = slice(row, row + len(good))
        with np.errstate(over="ignore"):
            result.ranges[rows, : block.beams] = values[:, head + 1 : head + 1 + block.beams]
        result.beams[rows] = block.beams
        result.head[rows] = values[:, :head]
        if poses:
            at = values.shape[1] - tail
            result.laser[rows], result.robot[rows] = values[:, at : at + 3], values[:, at + 3 : at + 6]
        result.stamps += [record.stamp for record in good]
        result.lines += [record.line for record in good]
        result.hosts.update(record.host for record in good)
        row += len(good)
    if row < size:
        for name in ("ranges", "beams", "head", "laser", "robot"):
            setattr(result, name, getattr(result, name)[:row])
    return result


def _laser_record(
    number: int, text: bytes, head: int, tail: int, counts: dict[bytes, int], skips: Skips
) -> tuple[LineRecord, int] | None:
    """A laser line and its number of beams, or None if the line is malformed.

    The line must have as many values as the beam count says. `counts` caches the beam counts by their text.
    """
    if b"  " in text or b"\t" in text:
        text = b" ".join(text.split())
    tokens = text.count(b" ") + 1
    start = text.split(b" ", head + 1)
    if not text or len(start) <= head:
        skips.add("wrong number of values", number)
        return None
    beams = counts.get(start[head]) or beam_count(start[head], number, skips)
    if beams is None:
        return None
    counts[start[head]] = beams
    needed = head + 1 + beams + tail + (1 if head else 0)
    if tokens == needed and not head:
        return LineRecord(number, text, tokens, ""), beams
    if tokens < needed + TRAILER or (tokens > needed + TRAILER and not head):
        skips.add("wrong number of values", number)
        return None
    values, stamp, host, _ = text.rsplit(b" ", TRAILER)
    return LineRecord(number, values, tokens - TRAILER, ascii_text(stamp), host), beams


def _plausible_records(
    block: Block, head: int, poses: int, tail: int, skips: Skips
) -> tuple[list[LineRecord], Array]:
    """The laser records of a block with plausible values, and these values; the others are skipped."""
    values = block.values
    problems: list[tuple[str, NDArray[np.bool_]]] = []
    if head:
        after = head + 1 + block.beams
        remissions = values[:, after] == values.shape[1] - (after + 1 + tail)
        angles = rows_within_bounds(values[:, :head]) & (np.abs(values[:, [1, 3]]).max(axis=1) <= MAX_ANGLE)
        problems += [("wrong number of values", ~remissions), ("an angle is out of bounds", ~angles)]
    if poses:
        at = values.shape[1] - tail
        problems.append(("a pose is out of bounds", ~rows_within_bounds(values[:, at : at + poses])))
    bad = np.zeros(len(values), dtype=np.bool_)
    for _, wrong in problems:
        bad |= wrong
    if not bad.any():
        return block.records, values
    for row in np.flatnonzero(bad).tolist():
        reason = next(reason for reason, wrong in problems if wrong[row])
        skips.add(reason, block.records[row].line)
    return [block.records[row] for row in np.flatnonzero(~bad).tolist()], values[~bad]
