"""Player text logs, as in the Radish collection: those of 2002, of Player 1, and of Player 2 and 3."""

from __future__ import annotations

import re

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.files.provenance import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import ReaderFindings, RecordedMotion, laser_log
from nscan_cli.logs.device_choice import Device, choose_device
from nscan_cli.logs.formats import FIRST_LINE
from nscan_cli.logs.heading_unit import are_in_degrees
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import player_records
from nscan_cli.logs.text.odometry_records import (
    headings_in_radians,
    odometry_of_records,
    odometry_of_scans,
)
from nscan_cli.logs.text.player_records import DeviceLines, PlayerScans, Version
from nscan_cli.logs.text.text_log_options import TextLogOptions
from nscan_cli.poses import Array, wrap

LINE_PATTERNS: tuple[tuple[Version, re.Pattern[bytes]], ...] = (
    (0, re.compile(rb"(laser|position(2d)?)[ \t]+\d+[ \t]+\d+(\.\d+)?(\s|$)")),
    (1, re.compile(rb"\d+\.\d+[ \t]+\S+[ \t]+\d+[ \t]+[a-z]\w*[ \t]+\d+[ \t]+\d+\.\d+(\s|$)")),
    (2, re.compile(rb"\d+\.\d+[ \t]+\S+[ \t]+\d+[ \t]+[a-z]\w*[ \t]+\d+[ \t]+\d+[ \t]+\d+(\s|$)")),
)
"""The beginning of a line. Version 1 has the time of the data where version 2 has type and subtype. In 2002
the interface is first."""
VERSION_NAMES: dict[Version, str] = {
    0: "Player, form of 2002",
    1: "Player, version 1",
    2: "Player, version 2",
}
LASER_INTERFACES = ("laser",)
ODOMETRY_INTERFACES = ("position", "position2d")
DATA_KINDS = ("", "1:1", "1:2")
"""Types and subtypes of records with scans or poses."""
BEGINS_AT_ZERO = "the bearings begin at 0°, and 0° is read as ahead; if 90° is ahead, give --angle-min -90"
UNKNOWN_MOUNT = "the log does not say how the laser is mounted: assumed at the robot's centre; see --mount"


def recognises(data: bytes) -> bool:
    """Whether one of the first lines begins as in a Player log. The very first one may be cut off."""
    return _version(data) is not None


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one laser of a Player log, with the odometry of a position device.

    Raises InputDataError if there is no readable scan, and WrongUsageError if the options do not fit the log
    or must choose between devices.
    """
    options.refuse_topics(file, "a Player log", "--laser laser:0", of_odometry=False)
    version = _version(data)
    assert version is not None
    skips = Skips(file, options.strict)
    lines = player_records.lines_by_device(data, version, skips)
    records = {f"{device} {kind}".strip(): len(found) for (device, kind), found in lines.items()}
    findings = ReaderFindings(skips, options, records)
    lasers = _devices(LASER_INTERFACES, lines)
    findings.lasers, findings.odometries = tuple(lasers), tuple(_devices(ODOMETRY_INTERFACES, lines))
    laser, findings.used["laser"] = choose_device("laser", options.laser, lasers, file)
    if laser is None:
        found = ", ".join(findings.records) or "no records"
        raise InputDataError(file, f"has no laser scans, only {found}", "give a log of a laser device")
    scans = player_records.player_scans(laser, lines, version, skips)
    if not scans.raw.stamps:
        raise skips.nothing_read(f"record of {laser}")
    if scans.bearings is not None:
        findings.used["laser"] += f", bearings in {scans.bearings}"
    if _begin_at_zero(scans):
        findings.warnings.append(BEGINS_AT_ZERO)
    times = order.scans_by_time(scans.raw.stamps, scans.raw.ranges)
    findings.warnings += times.warnings
    mount = _player_mount(laser, lines, findings)
    motion = RecordedMotion(_odometry(scans, lines, times, findings))
    form = VERSION_NAMES[version]
    return laser_log(source, form, laser, scans.raw, times, mount, motion, findings)


def _begin_at_zero(scans: PlayerScans) -> bool:
    """Whether the bearings go from 0° to about 180°, as lasers with 90° ahead count them."""
    last = scans.raw.angle_min + scans.raw.angle_increment * (scans.raw.ranges.shape[1] - 1)
    ends, checks = np.array([scans.raw.angle_min, last]), TextLogOptions()
    ends_there = abs(ends.max() - checks.last_bearing) < checks.last_bearing_tolerance
    return scans.bearings is not None and bool(ends.min() > checks.first_bearing and ends_there)


def _version(data: bytes) -> Version | None:
    if b"\0" in data[:512]:
        return None
    lines = (line.group(1) for line in FIRST_LINE.finditer(data, 0, 1 << 16))
    return next((version for line in lines for version, form in LINE_PATTERNS if form.match(line)), None)


def _devices(interfaces: tuple[str, ...], lines: DeviceLines) -> list[Device]:
    """The devices with these interfaces that have records of scans or poses."""
    counts: dict[str, int] = {}
    for (device, kind), found in sorted(lines.items()):
        if device.split(":")[-2] in interfaces and kind in DATA_KINDS:
            counts[device] = counts.get(device, 0) + len(found)
    return [Device(device, device.split(":")[-2], count) for device, count in counts.items()]


def _player_mount(laser: str, lines: DeviceLines, findings: ReaderFindings) -> Array:
    """Pose (3,) of the laser on the robot: --mount, else the log's geometry record (4:1), else zero."""
    if findings.options.mount is not None:
        findings.used["mounting"] = "--mount"
        return np.array(findings.options.mount, dtype=np.float64)
    rows, _ = player_records.poses_with_size(lines.get((laser, "4:1"), []), 5, findings.skips)
    if len(rows):
        mount: Array = rows[-1]
        mount[2] = wrap(mount[2])
        findings.used["mounting"] = f"the geometry (4:1) of {laser}"
        return mount
    findings.used["mounting"] = "assumed: at the robot's centre"
    findings.warnings.append(UNKNOWN_MOUNT)
    return np.zeros(3)


def _odometry(
    scans: PlayerScans, lines: DeviceLines, times: order.ScanOrder, findings: ReaderFindings
) -> Array | None:
    """Poses of the robot (S, 3) in order of time: those in the scans, else those of a position device."""
    options = findings.options
    if not options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return None
    if scans.robot is not None and scans.robot.any() and options.odom_topic is None:
        headings_in_radians([scans.robot], times.rows, findings)
        return odometry_of_scans(times, scans.robot, "the poses in the scans (1:2)", findings)
    device, why = choose_device("odometry", options.odom_topic, findings.odometries, findings.skips.file)
    found = [] if device is None else lines.get((device, ""), lines.get((device, "1:1"), []))
    values, stamps = player_records.device_poses(found, findings.skips)
    recorded = order.by_time(stamps)
    poses, origin = values[recorded.rows], f"{device}, {why}, interpolated"
    if scans.bearings == "degrees" and are_in_degrees(poses, TextLogOptions().beside_degrees):
        poses[:, 2] = np.radians(poses[:, 2])
        origin += ", headings in degrees"
    headings_in_radians([poses], np.arange(len(poses)), findings)
    name = f"record of {device or 'a position device'}"
    return odometry_of_records(times, recorded, poses, name, origin, findings)
