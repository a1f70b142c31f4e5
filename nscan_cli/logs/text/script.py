"""Logs in the .script form of D. Hähnel's tools, as the original of Intel Research Lab (Radish).

Source of the form: CARMEN, logtools (rec2d reader and writer). `POS sec usec: x y θ tv rv` and
`LASER-RANGE sec usec laser n fov: r…` in cm and degrees; the beams go from −fov/2 to fov/2 in n − 1 steps.
"""

from __future__ import annotations

import io
import re

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.limits import RECORD_KINDS
from nscan_cli.files.source import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import Findings, RawScans, RecordedMotion, laser_log, scan_table
from nscan_cli.logs.device_choice import Device, OpenChoiceError, device_list
from nscan_cli.logs.formats import FIRST_LINE
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text.line_records import LineRecord, beam_count, parsed, within_bounds
from nscan_cli.poses import Array, wrap

BEGIN = re.compile(rb"(POS|LASER-RANGE|LASER-SCAN)\s+\d+\s+\d+[^:]*:")
RECORD = re.compile(
    rb"(?P<tag>[A-Z][A-Z-]*)\s+(?P<sec>\d{1,12})\s+(?P<usec>\d{1,12})(?P<head>(\s[^:]*)?):(?P<values>.*)\Z"
)
LASER = "LASER-RANGE"
CM = 0.01
"""m"""
UNUSED = (LineRecord(0, b"", 0, ""), b"")
"""Stands for a line that is only counted."""
Lines = dict[str, list[tuple[LineRecord, bytes]]]
"""By tag, for lasers with their number: the record, and what stands between its time and the colon."""


def recognises(data: bytes) -> bool:
    """Whether the first line that is neither blank nor a comment is a POS or LASER-RANGE record."""
    line = FIRST_LINE.search(data, 0, 1 << 16)
    return line is not None and BEGIN.match(line.group(1)) is not None


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one laser, with POS as odometry; raises the same errors as the other readers."""
    options.refuse_topics(file, "a .script log", "--laser")
    skips = Skips(file, options.strict)
    lines = _lines(data, skips)
    findings = Findings(skips, {tag: len(found) for tag, found in lines.items()})
    lasers = [Device(tag, LASER, len(found)) for tag, found in lines.items() if tag.startswith(f"{LASER}:")]
    findings.lasers = tuple(lasers)
    said = device_list(lasers, "record")
    if not lasers:
        raise InputDataError(file, "has no LASER-RANGE record", "give a log with laser scans")
    if options.laser is not None and options.laser not in [laser.name for laser in lasers]:
        raise WrongUsageError(f"{file}: has no {options.laser}; --laser can be {said}")
    if options.laser is None and len(lasers) > 1:
        raise OpenChoiceError(file, "laser", lasers, "--laser", "record")
    laser = options.laser or lasers[0].name
    findings.used["laser"] = "chosen by --laser" if options.laser else "the only laser"
    raw = _scans(lines[laser], skips)
    if not raw.stamps:
        reason, (_, first) = next(iter(skips.reasons.items()))
        raise InputDataError(file, f"no {laser} record can be read: {reason}",
                             "give a log with whole records", first)  # fmt: skip
    times = order.by_time(raw.stamps)
    findings.warnings += times.warnings
    mount = np.array(options.mount or (0.0, 0.0, 0.0), dtype=np.float64)
    findings.used["mounting"] = "--mount" if options.mount else "assumed: at the robot's centre"
    motion = RecordedMotion(_odometry(lines, times, options, findings))
    return laser_log(source, ".script", laser, raw, times, mount, motion, findings, options, file)


def _lines(data: bytes, skips: Skips) -> Lines:
    lines: Lines = {}
    for number, line in enumerate(io.BytesIO(data), 1):
        text = line.strip()
        if not text or text[:1] in b"#*":
            continue
        parts = RECORD.match(text)
        if parts is None:
            skips.add("not a .script record", number)
            continue
        tag, head = parts["tag"].decode(), parts["head"]
        if tag in ("LASER-RANGE", "LASER-SCAN"):
            tag = f"LASER-RANGE:{head.split()[0].decode('ascii', 'replace') if head.strip() else ''}"
        if tag not in lines and len(lines) >= RECORD_KINDS.value:
            skips.add("a kind of record too many", number)
            continue
        if tag != "POS" and not tag.startswith("LASER-RANGE:"):
            lines.setdefault(tag, []).append(UNUSED)
            continue
        values = b" ".join(parts["values"].split())
        stamp = f"{int(parts['sec'])}.{int(parts['usec']):06d}"
        record = LineRecord(number, values, values.count(b" ") + 1 if values else 0, stamp)
        lines.setdefault(tag, []).append((record, head))
    return lines


def _scans(lines: list[tuple[LineRecord, bytes]], skips: Skips) -> RawScans:
    records, views = [], {}
    for record, head in lines:
        parts = head.split()
        beams = beam_count(parts[1], record.line, skips) if len(parts) > 2 else None
        try:
            # Behind the field of view a tag may stand.
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
    rows = [(record, values * CM) for record, _, values in parsed(records, skips)]
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


def _odometry(
    lines: Lines, times: order.ScanOrder, options: ReadingOptions, findings: Findings
) -> Array | None:
    if not options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return None
    rows, stamps = [], []
    for record, _, values in parsed([(record, 0) for record, _ in lines.get("POS", [])], findings.skips):
        if values.size not in (3, 5) or not within_bounds(values):
            findings.skips.add("not a pose of the robot", record.line)
            continue
        rows.append((values[0] * CM, values[1] * CM, wrap(np.radians(values[2]))))
        stamps.append(record.stamp)
    if not rows:
        findings.used["odometry"] = "none: no POS record"
        findings.warnings.append("the log has no POS record: no odometry")
        return None
    moments = order.by_time(stamps)
    if times.nominal or moments.nominal:
        findings.used["odometry"] = "none: no time stamps"
        findings.warnings.append("the time stamps do not lead from the scans to POS: no odometry")
        return None
    findings.used["odometry"] = "POS records, interpolated"
    poses = np.array(rows)[moments.rows]
    return interpolated_poses(times.times, moments.times, poses, "POS record", findings.warnings)
