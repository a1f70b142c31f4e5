"""CARMEN text logs, as in the Radish collection: FLASER, RLASER, RAWLASERn, ROBOTLASERn, LASER3…5."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.counting import counted
from nscan_cli.files.source import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import Findings, RawScans, RecordedMotion, laser_log
from nscan_cli.logs.device_choice import Device
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE, beam_angles, mount_from_poses
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text import carmen_records
from nscan_cli.logs.text import corrected_poses as corrected
from nscan_cli.logs.text.carmen_records import CarmenScans
from nscan_cli.poses import Array, relative, wrap

Lines = dict[str, list[tuple[int, bytes]]]
LASERS = ("FLASER", "ROBOTLASER1", "ROBOTLASER0", "RAWLASER1", "RLASER", "ROBOTLASER2", "RAWLASER2",
          "RAWLASER3", "RAWLASER4", "RAWLASER5", "LASER3", "LASER4", "LASER5")  # fmt: skip
"""Tags of laser records, the one to be preferred first: those of the laser in front, with poses."""
LARGEST_OFFSET = 1e3
"""m; what is beyond was never a mounting."""
REAR = ("RLASER", "ROBOTLASER2", "RAWLASER2")
FRONT = ("FLASER", "ROBOTLASER1", "ROBOTLASER0", "RAWLASER1")
TAGS = re.compile(
    r"((RAW|ROBOT)?LASER\d|[FR]LASER|ODOM|TRUEPOS|GLOBALPOS|PARAM|SYNC|ODOMETRY|ARM|IMU|XSENS|INERTIAL"
    r"|SONAR|BUMPER|PANTILT|PTU\w*|GPS\w*|NMEA\w*|NEFF|WEIGHT|MARKER|COMMENT|SM_UPDATE|SCANMARK|POSITION)"
)
"""The tags that CARMEN and GMapping write, and some that go with them."""
MOST_KINDS = 5
KNOWN = re.compile(
    rb"^[ \t]*(FLASER|RLASER|(RAW|ROBOT)?LASER\d|ODOM|TRUEPOS|PARAM|SYNC|GLOBALPOS)[ \t]", re.MULTILINE
)


def recognises(data: bytes) -> bool:
    """Whether it is text in which a line near the beginning starts with one of CARMEN's tags."""
    return b"\0" not in data[:512] and KNOWN.search(data, 0, 1 << 20) is not None


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one laser of a CARMEN log.

    Raises InputDataError when no scan is left to read or the poses are corrected ones, WrongUsageError
    when the options do not fit the log.
    """
    skips = Skips(file, options.strict)
    lines = carmen_records.lines_by_tag(data, skips)
    findings = Findings(skips, {name: len(found) for name, found in lines.items()})
    warnings, used = findings.warnings, findings.used
    options.refuse_topics(file, "a CARMEN log", "--laser")
    findings.lasers = tuple(Device(tag, tag, len(lines[tag])) for tag in LASERS if tag in lines)
    tag, used["laser"] = _chosen_laser(lines, options, file, warnings)
    strange = {name: count for name, count in findings.records.items() if not TAGS.fullmatch(name)}
    if strange:
        kinds = ", ".join(f"{name} ({count})" for name, count in list(strange.items())[:MOST_KINDS])
        more = ", …" if len(strange) > MOST_KINDS else ""
        warnings.append(
            f"{counted(sum(strange.values()), 'record')} of kinds unknown to CARMEN: {kinds}{more}"
        )
    scans = carmen_records.carmen_scans(tag, lines[tag], skips)
    if not scans.stamps:
        reason, (_, first) = next(iter(skips.reasons.items()))
        raise InputDataError(
            file, f"none of its {len(lines[tag])} {tag} records can be read: {reason}",
            "give a log with whole records", first,
        )  # fmt: skip
    findings.corrected = sign = corrected.sign_of_correction(lines, scans)
    if sign and options.odometry and not options.allow_corrected:
        raise InputDataError(
            file, f"its poses are a mapper's result, not odometry ({sign})",
            "give the raw log, or --allow-corrected to use them as odometry, or --no-odometry",
        )  # fmt: skip
    if sign:
        warnings.append(f"the poses are a mapper's result, not odometry ({sign})")
    params = _params(lines)
    times, by_logger = _times(lines[tag], scans, warnings)
    mount, used["mounting"] = _mount(tag, scans, params, options, warnings)
    angle_min, angle_increment, angle_max = _angles(scans)
    farthest, doubtful = _farthest(tag, scans, params)
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
    )
    odometry: Array | None = None
    used["odometry"] = "none: --no-odometry"
    if options.odometry:
        odometry, used["odometry"] = _odometry(tag, scans, times, by_logger, lines, skips, warnings)
    motion = RecordedMotion(odometry, *_truth(lines, by_logger, skips, warnings))
    return laser_log(source, "CARMEN", tag, raw, times, mount, motion, findings, options, file)


def _times(
    lines: list[tuple[int, bytes]], scans: CarmenScans, warnings: list[str]
) -> tuple[order.ScanOrder, bool]:
    """The scans in order of time, and whether it is that of the logger: only where their own say nothing."""
    times = order.by_time(scans.stamps)
    if times.nominal or not times.times.any():
        logged = order.by_time(carmen_records.logger_stamps(lines, scans))
        if not logged.nominal and logged.times[-1] > logged.times[0]:
            warnings += ["the scans' own time stamps say nothing: the logger's are used", *logged.warnings]
            return logged, True
    warnings += times.warnings
    return times, False


def _chosen_laser(lines: Lines, options: ReadingOptions, file: str, warnings: list[str]) -> tuple[str, str]:
    """The tag of the laser to use, and why."""
    present = [tag for tag in LASERS if tag in lines]
    if not present:
        found = ", ".join(lines) or "no record at all"
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
        return present[0], "the laser in front, with poses, before others"
    return present[0], "the only laser"


def _params(lines: Lines) -> dict[str, float]:
    """PARAM values that are numbers; the last one of a name holds."""
    params = {}
    for _, text in lines.get("PARAM", []):
        tokens = text.split()
        if len(tokens) > 1:
            try:
                params[tokens[0].decode("ascii", "replace")] = float(tokens[1])
            except ValueError:
                continue
    return params


def _mount(
    tag: str, scans: CarmenScans, params: Mapping[str, float], options: ReadingOptions, warnings: list[str]
) -> tuple[Array, str]:
    """The laser on the robot, and why: as the user says, else from both poses of the record, else from PARAM.

    CARMEN: laser pose = robot pose ⊕ (offset, side offset, angular offset), for the rear laser too, whose
    angular offset is half a turn where the log gives none.
    """
    if options.mount is not None:
        return np.array(options.mount, dtype=np.float64), "--mount"
    given = _param_mount(tag, params)
    if scans.robot.shape[1] and not np.array_equal(scans.laser, scans.robot):
        mount = mount_from_poses(scans.laser, scans.robot)
        if given is not None:
            off = np.abs(relative(mount, given))
            if max(off[0], off[1]) > 0.01 or off[2] > np.radians(0.5):
                warnings.append(
                    f"PARAM mounts the laser at {_said(given)}, the poses at {_said(mount)}: these hold"
                )
        return mount, f"both poses of {tag}"
    if given is not None:
        if scans.robot.shape[1] and given.any():
            warnings.append(f"both poses of {tag} are equal; the mounting is PARAM's, {_said(given)}")
        return given, "PARAM"
    if tag in REAR:
        warnings.append("the log does not say how the rear laser is mounted: taken as turned by 180°")
        return np.array([0.0, 0.0, np.pi]), "assumed: turned by 180°"
    if tag not in FRONT:
        warnings.append(
            f"the log does not say how {tag} is mounted: taken as at the robot's centre; see --mount"
        )
    return np.zeros(3), "assumed: at the robot's centre"


def _param_mount(tag: str, params: Mapping[str, float]) -> Array | None:
    side = "front" if tag in FRONT else "rear" if tag in REAR else None
    names = [f"robot_{side}laser_{what}" for what in ("offset", "side_offset", "angular_offset")]
    if not any(name in params for name in names):
        return None
    default = (0.0, 0.0, np.pi if side == "rear" else 0.0)
    values = np.array([params.get(name, usual) for name, usual in zip(names, default, strict=True)])
    if not (np.abs(values) < LARGEST_OFFSET).all():
        return None
    values[2] = wrap(values[2])
    return values


def _said(pose: Array) -> str:
    return f"{pose[0]:g} m, {pose[1]:g} m, {np.degrees(pose[2]):g}°"


def _angles(scans: CarmenScans) -> tuple[Array, Array, Array]:
    """First direction, step and last direction (S,) of each scan, rad; nan for a last one that none says."""
    counts, which = np.unique(scans.beams, return_inverse=True)
    angles = np.array([beam_angles(beams) for beams in counts.tolist()])[which]
    last = np.full(len(angles), np.nan)
    if scans.head.shape[1]:
        known = scans.head[:, 3] != 0
        angles[known] = scans.head[known][:, (1, 3)]
        last[known] = scans.head[known][:, (1, 2)].sum(axis=1)
    return angles[:, 0], angles[:, 1], last


def _farthest(
    tag: str, scans: CarmenScans, params: Mapping[str, float]
) -> tuple[float, Sequence[tuple[float, str]]]:
    """The range (m) from which on a reading says that nothing was met, and others that the log names.

    The PARAM is what CARMEN's robot module goes by; people set it to what they navigate with.
    """
    named = []
    if scans.head.shape[1] and (scans.head[:, 4] > 0).any():
        named.append((float(scans.head[:, 4].max()), f"the greatest range in {tag}"))
    farthest = max([CARMEN_MAX_RANGE, *(limit for limit, _ in named)])
    side = "front" if tag in FRONT else "rear"
    param = f"robot_{side}_laser_max"
    if tag in (*FRONT, *REAR) and params.get(param, 0) > 0:
        named.append((params[param], f"PARAM {param}"))
    return farthest, named


def _odometry(
    tag: str,
    scans: CarmenScans,
    times: order.ScanOrder,
    by_logger: bool,
    lines: Lines,
    skips: Skips,
    warnings: list[str],
) -> tuple[Array | None, str]:
    """Poses of the robot (S, 3) in order of time, and why: the record's own, else of the ODOM lines."""
    if scans.robot.shape[1]:
        if len(times.rows) > 1 and not scans.robot.any():
            warnings.append("all poses are zero: taken as a log without odometry")
            return None, "none: all poses are zero"
        poses = scans.robot[times.rows]
        poses[:, 2] = wrap(poses[:, 2])
        return poses, f"the poses in {tag}"
    values, stamps, _ = carmen_records.numbers(lines.get("ODOM", []), 6, skips, by_logger=by_logger)
    if not len(values):
        warnings.append(f"{tag} carries no pose and the log has no ODOM record: no odometry")
        return None, "none: no pose in the log"
    moments = order.by_time(stamps)
    if times.nominal or moments.nominal:
        warnings.append(f"{tag} carries no pose, and the time stamps do not lead to ODOM's: no odometry")
        return None, "none: no time stamps"
    found = interpolated_poses(times.times, moments.times, values[moments.rows, :3], "ODOM record", warnings)
    return found, "none: at other times" if found is None else "ODOM records, interpolated"


def _truth(
    lines: Lines, by_logger: bool, skips: Skips, warnings: list[str]
) -> tuple[Array | None, Array | None]:
    """Times (T,) and true poses (T, 3) of the TRUEPOS records, sorted by time."""
    values, stamps, _ = carmen_records.numbers(lines.get("TRUEPOS", []), 6, skips, by_logger=by_logger)
    if not len(values):
        return None, None
    moments = order.by_time(stamps)
    if moments.nominal:
        warnings.append("the time stamps of TRUEPOS say nothing: no true poses")
        return None, None
    return moments.times, values[moments.rows, :3]
