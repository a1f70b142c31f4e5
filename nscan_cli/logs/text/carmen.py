"""CARMEN text logs, as in the Radish collection: FLASER, RLASER, RAWLASERn, ROBOTLASERn, LASER3…5."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.provenance import Source
from nscan_cli.files.text import counted, shortened_list
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import ReaderFindings, RecordedMotion, laser_log
from nscan_cli.logs.copies import without_copies
from nscan_cli.logs.device_choice import Device
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE, beam_angles, mount_from_poses
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import carmen_records
from nscan_cli.logs.text.carmen_records import CarmenScans, TaggedLines
from nscan_cli.logs.text.corrected_poses import sign_of_correction
from nscan_cli.logs.text.interlaced_scans import between_the_others
from nscan_cli.logs.text.odometry_records import (
    headings_in_radians,
    odometry_of_records,
    odometry_of_scans,
)
from nscan_cli.logs.text.text_log_options import TextLogOptions
from nscan_cli.poses import Array, relative, wrap

LASERS = ("FLASER", "ROBOTLASER1", "ROBOTLASER0", "RAWLASER1", "RLASER", "ROBOTLASER2", "RAWLASER2",
          "RAWLASER3", "RAWLASER4", "RAWLASER5", "LASER3", "LASER4", "LASER5")  # fmt: skip
"""Tags of laser records in order of preference: first those of the front laser that carry poses."""
REAR_LASERS = ("RLASER", "ROBOTLASER2", "RAWLASER2")
FRONT_LASERS = ("FLASER", "ROBOTLASER1", "ROBOTLASER0", "RAWLASER1")
KNOWN_TAGS = re.compile(
    r"((RAW|ROBOT)?LASER\d|[FR]LASER|ODOM|TRUEPOS|GLOBALPOS|PARAM|SYNC|ODOMETRY|ARM|IMU|XSENS|INERTIAL"
    r"|SONAR|BUMPER|PANTILT|PTU\w*|GPS\w*|NMEA\w*|NEFF|WEIGHT|MARKER|COMMENT|SM_UPDATE|SCANMARK|POSITION)"
)
"""The tags that CARMEN and GMapping write, and others that are usual in such logs."""
CARMEN_LINE = re.compile(
    rb"^[ \t]*(FLASER|RLASER|(RAW|ROBOT)?LASER\d|ODOM|TRUEPOS|PARAM|SYNC|GLOBALPOS)[ \t]", re.MULTILINE
)


def recognises(data: bytes) -> bool:
    """Whether a line near the beginning of a text starts with one of CARMEN's tags."""
    return b"\0" not in data[:512] and CARMEN_LINE.search(data, 0, 1 << 20) is not None


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one laser of a CARMEN log.

    Raises InputDataError if there is no readable scan or the poses are corrected ones, and WrongUsageError
    if the options do not fit the log.
    """
    skips = Skips(file, options.strict)
    lines = carmen_records.lines_by_tag(data, skips)
    findings = ReaderFindings(skips, options, {name: len(found) for name, found in lines.items()})
    warnings, used = findings.warnings, findings.used
    options.refuse_topics(file, "a CARMEN log", "--laser")
    findings.lasers = tuple(Device(tag, tag, len(lines[tag])) for tag in LASERS if tag in lines)
    tag, used["laser"] = _chosen_laser(lines, options, file, warnings)
    unknown = {name: count for name, count in findings.records.items() if not KNOWN_TAGS.fullmatch(name)}
    if unknown:
        kinds = shortened_list([f"{name} ({count})" for name, count in unknown.items()])
        warnings.append(f"{counted(sum(unknown.values()), 'record')} of kinds unknown to CARMEN: {kinds}")
    for name in {tag, "ODOM"} & lines.keys():
        lines[name], twice = without_copies(lines[name], lambda line: line[1])
        if twice and name == tag:
            warnings.append(twice)
    scans = carmen_records.carmen_scans(tag, lines[tag], skips)
    if not scans.stamps:
        raise skips.nothing_read(f"{tag} record")
    findings.corrected = sign = sign_of_correction(lines, scans)
    if sign and options.odometry and not options.allow_corrected:
        raise InputDataError(
            file, f"its poses are a mapper's result, not odometry ({sign})",
            "give the raw log, or --allow-corrected to use them as odometry, or --no-odometry",
        )  # fmt: skip
    if sign:
        warnings.append(f"the poses are a mapper's result, not odometry ({sign})")
    params = _params(lines)
    times, by_logger = _scan_order(lines[tag], scans, warnings)
    headings_in_radians([scans.robot, scans.laser], times.rows, findings)
    mount, used["mounting"] = _carmen_mount(tag, scans, params, options, warnings)
    angle_min, angle_increment, angle_max = _angles(scans, used)
    farthest, doubtful = _max_range(tag, scans, params)
    raw = RawScans(
        scans.ranges,
        angle_min,
        angle_increment,
        scans.stamps,
        (0.0, farthest),
        ("none in a CARMEN log", "CARMEN's greatest range"),
        doubtful,
        angle_max,
        scans.beams,
        angles_assumed=not scans.head[:, 3:4].any(),
    )
    odometry = _odometry(tag, scans, times, by_logger, lines, findings)
    motion = RecordedMotion(odometry, *_true_poses(lines, by_logger, skips, warnings))
    return laser_log(source, "CARMEN", tag, raw, times, mount, motion, findings)


def _scan_order(
    lines: list[tuple[int, bytes]], scans: CarmenScans, warnings: list[str]
) -> tuple[order.ScanOrder, bool]:
    """The scans in order of time, and whether the logger's stamps replace the scans' own, unusable ones."""
    times = order.scans_by_time(scans.stamps, scans.ranges)
    if times.nominal or not times.times.any():
        logged = order.scans_by_time(carmen_records.logger_stamps(lines, scans), scans.ranges)
        if not logged.nominal and logged.times[-1] > logged.times[0]:
            warnings += ["the scans' own time stamps are unusable: the logger's are used", *logged.warnings]
            return logged, True
    warnings += times.warnings
    return times, False


def _chosen_laser(
    lines: TaggedLines, options: ReadingOptions, file: str, warnings: list[str]
) -> tuple[str, str]:
    """The tag of the laser to use, and the reason. Raises InputDataError and WrongUsageError."""
    present = [tag for tag in LASERS if tag in lines]
    if not present:
        found = ", ".join(lines) or "no records"
        raise InputDataError(
            file, f"has no laser scans, only {found}", f"give a log with {LASERS[0]} records"
        )
    if options.laser is not None:
        if options.laser not in present:
            raise WrongUsageError(
                f"{file}: has no {options.laser} scans; --laser can be {', '.join(present)}"
            )
        return options.laser, "chosen by --laser"
    others = ", ".join(f"{tag} ({len(lines[tag])})" for tag in present[1:])
    if others:
        warnings.append(f"{present[0]} is used; --laser would choose {others}")
        return present[0], "the front laser, with poses, is preferred"
    return present[0], "the only laser"


def _params(lines: TaggedLines) -> dict[str, float]:
    """The PARAM values that are numbers; the last one of a name is used."""
    params = {}
    for _, text in lines.get("PARAM", []):
        tokens = text.split()
        if len(tokens) > 1:
            try:
                params[tokens[0].decode("ascii", "replace")] = float(tokens[1])
            except ValueError:
                continue
    return params


def _carmen_mount(
    tag: str, scans: CarmenScans, params: Mapping[str, float], options: ReadingOptions, warnings: list[str]
) -> tuple[Array, str]:
    """Pose (3,) of the laser on the robot, and its origin: --mount, else the record's poses, else PARAM.

    CARMEN: laser pose = robot pose ⊕ (offset, side offset, angular offset). The angular offset of the rear
    laser is 180° if the log has none.
    """
    if options.mount is not None:
        return np.array(options.mount, dtype=np.float64), "--mount"
    given = _param_mount(tag, params)
    if scans.robot.shape[1] and not np.array_equal(scans.laser, scans.robot):
        mount = mount_from_poses(scans.laser, scans.robot)
        if given is not None:
            off, checks = np.abs(relative(mount, given)), TextLogOptions()
            if max(off[0], off[1]) > checks.mount_difference or off[2] > checks.mount_turn_difference:
                warnings.append(
                    f"PARAM mounts the laser at {_pose_text(given)}, the poses at {_pose_text(mount)}: "
                    "that of the poses is used"
                )
        return mount, f"both poses of {tag}"
    if given is not None:
        if scans.robot.shape[1] and given.any():
            warnings.append(f"both poses of {tag} are equal; the mounting is PARAM's, {_pose_text(given)}")
        return given, "PARAM"
    if tag in REAR_LASERS:
        warnings.append("the log does not say how the rear laser is mounted: assumed turned by 180°")
        return np.array([0.0, 0.0, np.pi]), "assumed: turned by 180°"
    if tag not in FRONT_LASERS:
        warnings.append(
            f"the log does not say how {tag} is mounted: assumed at the robot's centre; see --mount"
        )
    return np.zeros(3), "assumed: at the robot's centre"


def _param_mount(tag: str, params: Mapping[str, float]) -> Array | None:
    """The mounting (3,) that PARAM gives, or None if it gives none or an absurd one."""
    side = "front" if tag in FRONT_LASERS else "rear" if tag in REAR_LASERS else None
    names = [f"robot_{side}laser_{what}" for what in ("offset", "side_offset", "angular_offset")]
    if not any(name in params for name in names):
        return None
    default = (0.0, 0.0, np.pi if side == "rear" else 0.0)
    values = np.array([params.get(name, value) for name, value in zip(names, default, strict=True)])
    if not (np.abs(values) < TextLogOptions.max_mount).all():
        return None
    values[2] = wrap(values[2])
    return values


def _pose_text(pose: Array) -> str:
    return f"{pose[0]:g} m, {pose[1]:g} m, {np.degrees(pose[2]):g}°"


def _angles(scans: CarmenScans, used: dict[str, str]) -> tuple[Array, Array, Array]:
    """First direction, step and last direction (S,) of each scan, rad; nan for an unknown last one.

    Says in `used` if scans are interlaced.
    """
    counts, which = np.unique(scans.beams, return_inverse=True)
    angles = np.array([beam_angles(beams) for beams in counts.tolist()])[which]
    last = np.full(len(angles), np.nan)
    if scans.head.shape[1]:
        known = scans.head[:, 3] != 0
        angles[known] = scans.head[known][:, (1, 3)]
        last[known] = scans.head[known][:, (1, 2)].sum(axis=1)
    between = between_the_others(scans.beams, *angles.T)
    if between.any():
        half = 0.5 * angles[between, 1]
        angles[between, 0] += half
        last[between] += half
        used["beams"] = (
            f"{counted(int(between.sum()), 'scan')} of {len(between)} have {scans.beams[between][0]} readings"
            f" that lie between those of the others: they begin {np.degrees(half[0]):g}° later"
        )
    return angles[:, 0], angles[:, 1], last


def _max_range(
    tag: str, scans: CarmenScans, params: Mapping[str, float]
) -> tuple[float, Sequence[tuple[float, str]]]:
    """The range (m) from which a reading means no return, and limits that may be the navigation's instead.

    CARMEN's robot module uses the PARAM, which people often set for navigation.
    """
    named = []
    if scans.head.shape[1] and (scans.head[:, 4] > 0).any():
        named.append((float(scans.head[:, 4].max()), f"the greatest range in {tag}"))
    farthest = max([CARMEN_MAX_RANGE, *(limit for limit, _ in named)])
    side = "front" if tag in FRONT_LASERS else "rear"
    param = f"robot_{side}_laser_max"
    if tag in (*FRONT_LASERS, *REAR_LASERS) and params.get(param, 0) > 0:
        named.append((params[param], f"PARAM {param}"))
    return farthest, named


def _odometry(
    tag: str,
    scans: CarmenScans,
    times: order.ScanOrder,
    by_logger: bool,
    lines: TaggedLines,
    findings: ReaderFindings,
) -> Array | None:
    """Poses of the robot (S, 3) in order of time: the scans' own, else those of the ODOM records."""
    if not findings.options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return None
    if not scans.robot.shape[1]:
        values, stamps = carmen_records.carmen_poses(lines.get("ODOM", []), findings.skips, by_logger)
        recorded = order.by_time(stamps)
        headings_in_radians([values], recorded.rows, findings)
        name, origin = "ODOM record", "ODOM records, interpolated"
        return odometry_of_records(times, recorded, values[recorded.rows], name, origin, findings)
    if len(times.rows) > 1 and not scans.robot.any():
        findings.used["odometry"] = "none: all poses are zero"
        findings.warnings.append("all poses are zero: the log is read as one without odometry")
        return None
    return odometry_of_scans(times, scans.robot, f"the poses in {tag}", findings)


def _true_poses(
    lines: TaggedLines, by_logger: bool, skips: Skips, warnings: list[str]
) -> tuple[Array | None, Array | None]:
    """Times (T,) and true poses (T, 3) of the TRUEPOS records, sorted by time."""
    values, stamps = carmen_records.carmen_poses(lines.get("TRUEPOS", []), skips, by_logger)
    if not len(values):
        return None, None
    recorded = order.by_time(stamps)
    if recorded.nominal:
        warnings.append("the time stamps of TRUEPOS are unusable: no true poses")
        return None, None
    return recorded.times, values[recorded.rows]
