"""Player text logs, as in the Radish collection: of 2002, of Player 1, of Player 2 and 3."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.source import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import Findings, RecordedMotion, laser_log
from nscan_cli.logs.device_choice import Device, OpenChoiceError, device_list
from nscan_cli.logs.formats import FIRST_LINE
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import player_bearings, player_records
from nscan_cli.logs.text.player_records import Lines, PlayerScans, Version
from nscan_cli.poses import Array, wrap

FORMS: tuple[tuple[Version, re.Pattern[bytes]], ...] = (
    (0, re.compile(rb"(laser|position(2d)?)[ \t]+\d+[ \t]+\d+(\.\d+)?(\s|$)")),
    (1, re.compile(rb"\d+\.\d+[ \t]+\S+[ \t]+\d+[ \t]+[a-z]\w*[ \t]+\d+[ \t]+\d+\.\d+(\s|$)")),
    (2, re.compile(rb"\d+\.\d+[ \t]+\S+[ \t]+\d+[ \t]+[a-z]\w*[ \t]+\d+[ \t]+\d+[ \t]+\d+(\s|$)")),
)
"""Version 1 has the time of the data where version 2 has type and subtype. In 2002 the interface is first."""
NAMES: dict[Version, str] = {0: "Player, form of 2002", 1: "Player, version 1", 2: "Player, version 2"}
LASER = ("laser",)
ODOMETRY = ("position", "position2d")
DATA = ("", "1:1", "1:2")
"""The kinds of records that hold scans or poses."""
BEGINS_AT_ZERO = (
    "the bearings begin at 0° and are taken as written, 0° ahead; where 90° is ahead give --angle-min -90"
)
UNSAID_MOUNT = "the log does not say how the laser is mounted: taken as at the robot's centre; see --mount"


def recognises(data: bytes) -> bool:
    """Whether one of the first lines has a Player log's beginning: the first of all may be cut off."""
    return _version(data) is not None


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one laser of a Player log, with the odometry of a position device.

    Raises InputDataError when no scan is left to read, WrongUsageError when the options do not fit the
    log or have to choose between devices.
    """
    options.refuse_topic(file, "a Player log", "--laser laser:0")
    version = _version(data)
    assert version is not None
    skips = Skips(file, options.strict)
    lines = player_records.lines_by_device(data, version, skips)
    findings = Findings(skips, {_said(key): len(found) for key, found in lines.items()})
    lasers = _devices(LASER, lines)
    findings.lasers, findings.odometries = tuple(lasers), tuple(_devices(ODOMETRY, lines))
    laser, findings.used["laser"] = _chosen("laser", options.laser, lasers, file)
    if laser is None:
        found = ", ".join(findings.records) or "no record at all"
        raise InputDataError(file, f"has no laser scans, only {found}", "give a log of a laser device")
    scans = player_records.player_scans(laser, lines, version, skips)
    if not scans.raw.stamps:
        reason, (_, first) = next(iter(skips.reasons.items()))
        problem = f"no record of {laser} can be read: {reason}"
        raise InputDataError(file, problem, "give a log with whole records", first)
    if scans.bearings is not None:
        findings.used["laser"] += f", bearings in {scans.bearings}"
    if _begin_at_zero(scans):
        findings.warnings.append(BEGINS_AT_ZERO)
    times = order.by_time(scans.raw.stamps)
    findings.warnings += times.warnings
    mount = _mount(laser, lines, options, findings)
    odometry = _odometry(scans, lines, times, options, findings, file)
    motion = RecordedMotion(odometry)
    return laser_log(source, NAMES[version], laser, scans.raw, times, mount, motion, findings, options, file)


def _begin_at_zero(scans: PlayerScans) -> bool:
    """Whether the bearings go from 0 to about half a turn, as lasers count that have 90° ahead."""
    last = scans.raw.angle_min + scans.raw.angle_increment * (scans.raw.ranges.shape[1] - 1)
    ends = np.degrees(np.array([scans.raw.angle_min, last]))
    return scans.bearings is not None and bool((ends.min() > -1) & (np.abs(ends.max() - 180) < 30))


def _version(data: bytes) -> Version | None:
    if b"\0" in data[:512]:
        return None
    lines = (line.group(1) for line in FIRST_LINE.finditer(data, 0, 1 << 16))
    return next((version for line in lines for version, form in FORMS if form.match(line)), None)


def _devices(interfaces: tuple[str, ...], lines: Lines) -> list[Device]:
    """The devices of some interfaces that have records of scans or poses."""
    counts: dict[str, int] = {}
    for (device, kind), found in sorted(lines.items()):
        if device.split(":")[-2] in interfaces and kind in DATA:
            counts[device] = counts.get(device, 0) + len(found)
    return [Device(device, device.split(":")[-2], count) for device, count in counts.items()]


def _chosen(
    what: Literal["laser", "odometry"], asked: str | None, there: Sequence[Device], file: str
) -> tuple[str | None, str]:
    """The device to use, and why; None when there is none.

    Raises WrongUsageError when the one asked for is not there, OpenChoiceError when there are several and
    none is asked for.
    """
    option = "--laser" if what == "laser" else "--odom-topic"
    said = device_list(there, "record") or "left out"
    if asked is not None:
        if asked not in [device.name for device in there]:
            raise WrongUsageError(f"{file}: has no {asked}; {option} can be {said}")
        return asked, f"chosen by {option}"
    if len(there) > 1:
        raise OpenChoiceError(file, what, there, option, "record")
    return (there[0].name, f"the only {there[0].type} device") if there else (None, "")


def _mount(laser: str, lines: Lines, options: ReadingOptions, findings: Findings) -> Array:
    """The laser on the robot: as the user says, else of the log's geometry record (4:1), else none."""
    if options.mount is not None:
        findings.used["mounting"] = "--mount"
        return np.array(options.mount, dtype=np.float64)
    rows, _ = player_records.numbers(lines.get((laser, "4:1"), []), 5, findings.skips)
    if len(rows):
        mount: Array = rows[-1, :3]
        mount[2] = wrap(mount[2])
        findings.used["mounting"] = f"the geometry (4:1) of {laser}"
        return mount
    findings.used["mounting"] = "assumed: at the robot's centre"
    findings.warnings.append(UNSAID_MOUNT)
    return np.zeros(3)


def _odometry(
    scans: PlayerScans,
    lines: Lines,
    times: order.ScanOrder,
    options: ReadingOptions,
    findings: Findings,
    file: str,
) -> Array | None:
    """Poses of the robot (S, 3) in order of time: those in the scans, else of a position device."""
    used, warnings = findings.used, findings.warnings
    if not options.odometry:
        used["odometry"] = "none: --no-odometry"
        return None
    if scans.robot is not None and scans.robot.any() and options.odom_topic is None:
        poses = scans.robot[times.rows]
        poses[:, 2] = wrap(poses[:, 2])
        used["odometry"] = "the poses in the scans (1:2)"
        return poses
    device, why = _chosen("odometry", options.odom_topic, findings.odometries, file)
    found = [] if device is None else lines.get((device, ""), lines.get((device, "1:1"), []))
    values, stamps = player_records.poses(found, findings.skips)
    if not len(values):
        warnings.append("the log has no record of a position device: no odometry")
        used["odometry"] = "none: no pose in the log"
        return None
    moments = order.by_time(stamps)
    if times.nominal or moments.nominal:
        warnings.append(f"the time stamps do not lead from the scans to {device}: no odometry")
        used["odometry"] = "none: no time stamps"
        return None
    used["odometry"] = f"{device}, {why}, interpolated"
    poses = values[moments.rows, :3]
    if scans.bearings == "degrees" and player_bearings.has_degrees(poses):
        poses[:, 2] = np.radians(poses[:, 2])
        used["odometry"] += ", headings in degrees"
    return interpolated_poses(times.times, moments.times, poses, f"record of {device}", warnings)


def _said(key: tuple[str, str]) -> str:
    device, kind = key
    return f"{device} {kind}".strip()
