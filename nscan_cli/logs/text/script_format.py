"""Logs in the .script form of D. Hähnel's tools, such as the original Intel Research Lab log (Radish).

Source of the form: CARMEN, logtools (rec2d reader and writer). `POS sec usec: x y θ tv rv` and
`LASER-RANGE sec usec laser n fov: r…` in cm and degrees.
The beams go from −fov/2 to fov/2 in n − 1 steps.
"""

from __future__ import annotations

import re

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.files.limits import RECORD_KINDS
from nscan_cli.files.provenance import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import ReaderFindings, RecordedMotion, laser_log
from nscan_cli.logs.device_choice import Device, choose_device
from nscan_cli.logs.formats import FIRST_LINE
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.raw_scans import RawScans, scan_table
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text.line_records import LineRecord, beam_count, parsed, parsed_poses, record_lines
from nscan_cli.logs.text.odometry_records import odometry_of_records
from nscan_cli.poses import Array, wrap

FIRST_RECORD = re.compile(rb"(POS|LASER-RANGE|LASER-SCAN)\s+\d+\s+\d+[^:]*:")
RECORD = re.compile(
    rb"(?P<tag>[A-Z][A-Z-]*)\s+(?P<sec>\d{1,12})\s+(?P<usec>\d{1,12})(?P<head>(\s[^:]*)?):(?P<values>.*)\Z"
)
LASER_RANGE = "LASER-RANGE"
METRES_PER_CM = 0.01
SKIPPED_RECORD = (LineRecord(0, b"", 0, ""), b"")
"""Placeholder for a line that is only counted."""
ScriptRecords = dict[str, list[tuple[LineRecord, bytes]]]
"""Records, and the text between time and colon, by tag; the tag of a laser includes its number."""


def recognises(data: bytes) -> bool:
    """Whether the first line that is neither blank nor a comment is a POS or LASER-RANGE record."""
    line = FIRST_LINE.search(data, 0, 1 << 16)
    return line is not None and FIRST_RECORD.match(line.group(1)) is not None


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one laser, with POS as odometry. Raises InputDataError and WrongUsageError."""
    options.refuse_topics(file, "a .script log", "--laser")
    skips = Skips(file, options.strict)
    records = _records_by_tag(data, skips)
    findings = ReaderFindings(skips, options, {tag: len(found) for tag, found in records.items()})
    findings.lasers = tuple(
        Device(tag, LASER_RANGE, len(found))
        for tag, found in records.items()
        if tag.startswith(f"{LASER_RANGE}:")
    )
    laser, findings.used["laser"] = choose_device("laser", options.laser, findings.lasers, file)
    if laser is None:
        raise InputDataError(file, "has no LASER-RANGE record", "give a log with laser scans")
    raw = _script_scans(records[laser], skips)
    if not raw.stamps:
        raise skips.nothing_read(f"{laser} record")
    times = order.scans_by_time(raw.stamps, raw.ranges)
    findings.warnings += times.warnings
    mount = np.array(options.mount or (0.0, 0.0, 0.0), dtype=np.float64)
    findings.used["mounting"] = "--mount" if options.mount else "assumed: at the robot's centre"
    motion = RecordedMotion(_odometry(records, times, findings))
    return laser_log(source, ".script", laser, raw, times, mount, motion, findings)


def _records_by_tag(data: bytes, skips: Skips) -> ScriptRecords:
    """The records of a log by tag; other lines are skipped."""
    records: ScriptRecords = {}
    for number, text in record_lines(data, comments=b"#*"):
        parts = RECORD.match(text)
        if parts is None:
            skips.add("not a .script record", number)
            continue
        tag, head = parts["tag"].decode(), parts["head"]
        if tag in (LASER_RANGE, "LASER-SCAN"):
            tag = f"{LASER_RANGE}:{head.split()[0].decode('ascii', 'replace') if head.strip() else ''}"
        if tag not in records and len(records) >= RECORD_KINDS.value:
            skips.add("too many kinds of records", number)
            continue
        record = SKIPPED_RECORD
        if tag == "POS" or tag.startswith(f"{LASER_RANGE}:"):
            stamp = f"{int(parts['sec'])}.{int(parts['usec']):06d}"
            record = (LineRecord.from_payload(number, parts["values"], stamp), head)
        records.setdefault(tag, []).append(record)
    return records


def _script_scans(laser_records: list[tuple[LineRecord, bytes]], skips: Skips) -> RawScans:
    """The scans in m and rad; malformed records are skipped. Raises LimitExceededError."""
    records, views = [], {}
    for record, head in laser_records:
        parts = head.split()
        beams = beam_count(parts[1], record.line, skips) if len(parts) > 2 else None
        try:
            # A tag may follow the field of view.
            view = float(parts[2])
        except (ValueError, IndexError):
            view = 0.0
        if len(parts) < 3 or not 0 < view <= 360:
            skips.add("the field of view is not in 0°…360°", record.line)
        elif beams is not None and record.count != beams:
            skips.add("wrong number of values", record.line)
        elif beams is not None:
            records.append((record, beams))
            views[record.line] = np.radians(view)
    rows = [(record, values * METRES_PER_CM) for record, _, values in parsed(records, skips)]
    fov = np.array([views[record.line] for record, _ in rows])
    steps = np.array([max(len(row) - 1, 1) for _, row in rows])
    stamps = [record.stamp for record, _ in rows]
    return RawScans(
        scan_table([row for _, row in rows]),
        -fov / 2,
        fov / steps,
        stamps,
        (0.0, CARMEN_MAX_RANGE),
        ("none in a .script log", "assumed, as for CARMEN"),
        beams=np.array([len(row) for _, row in rows], dtype=np.int64),
    )


def _odometry(records: ScriptRecords, times: order.ScanOrder, findings: ReaderFindings) -> Array | None:
    """Poses of the robot (S, 3) in order of time, those of the POS records, or None."""
    if not findings.options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return None
    values, stamps = parsed_poses([record for record, _ in records.get("POS", [])], (3, 5), findings.skips)
    recorded = order.by_time(stamps)
    poses = values[recorded.rows] * (METRES_PER_CM, METRES_PER_CM, 1.0)
    poses[:, 2] = wrap(np.radians(poses[:, 2]))
    origin = "POS records, interpolated"
    return odometry_of_records(times, recorded, poses, "POS record", origin, findings)
