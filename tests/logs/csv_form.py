"""A form of log for a test, as somebody would add it: a scan a line, `seconds,x,y,heading,range,range,…`."""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.files.provenance import Source
from nscan_cli.logs.assemble import ReaderFindings, RecordedMotion, laser_log
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.raw_scans import RawScans, scan_table
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.scan_order import by_time
from nscan_cli.logs.skips import Skips

HEAD = b"seconds,x,y,heading,ranges\n"


def recognises(data: bytes) -> bool:
    return data.startswith(HEAD)


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    options.refuse_topics(file, "a CSV log", "--mount")
    findings = ReaderFindings(Skips(file, options.strict), options)
    rows, stamps = [], []
    for number, line in enumerate(data.splitlines()[1:], start=2):
        fields = line.decode("ascii", "replace").split(",")
        try:
            rows.append(np.array([float(field) for field in fields[1:]]))
            stamps.append(fields[0])
        except ValueError:
            findings.skips.add("a value is not a number", number)
    if not rows:
        raise InputDataError(file, "has no scan", "give a log with scans")
    ranges = scan_table([row[3:] for row in rows])
    count, beams = ranges.shape
    half_turn = np.full(count, -math.pi / 2), np.full(count, math.pi / max(beams - 1, 1))
    times = by_time(stamps)
    odometry = np.array([row[:3] for row in rows])[times.rows] if options.odometry else None
    mount = np.array(options.mount or (0.0, 0.0, 0.0))
    findings.used |= {"laser": "the only laser", "mounting": "the robot's centre", "odometry": "the columns"}
    raw = RawScans(ranges, *half_turn, stamps, (0.0, 80.0))
    motion = RecordedMotion(odometry)
    return laser_log(source, "CSV", "the laser", raw, times, mount, motion, findings)
