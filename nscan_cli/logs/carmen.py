"""CARMEN text logs, as in the Radish collection: FLASER, RLASER, RAWLASERn, ROBOTLASERn, LASER3…5."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs import carmen_records, corrected, order
from nscan_cli.logs.carmen_records import Scans, Skips
from nscan_cli.logs.laser import (
    CARMEN_MAX_RANGE,
    beam_angles,
    mark_no_returns,
    mount_from_poses,
    no_return_value,
)
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.scan import LaserLog, LogReport, Source
from nscan_cli.poses import Array, relative, wrap

Lines = dict[str, list[tuple[int, bytes]]]
LASERS = ("FLASER", "ROBOTLASER1", "ROBOTLASER0", "RAWLASER1", "RLASER", "ROBOTLASER2", "RAWLASER2",
          "RAWLASER3", "RAWLASER4", "RAWLASER5", "LASER3", "LASER4", "LASER5")  # fmt: skip
"""Tags of laser records, the one to be preferred first: those of the laser in front, with poses."""
LARGEST_OFFSET = 1e3
"""m; what is beyond was never a mounting."""
REAR = ("RLASER", "ROBOTLASER2", "RAWLASER2")
FRONT = ("FLASER", "ROBOTLASER1", "ROBOTLASER0", "RAWLASER1")
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
    warnings: list[str] = []
    tag = _chosen_laser(lines, options, file, warnings)
    scans = carmen_records.scans(tag, lines[tag], skips)
    if not scans.stamps:
        reason, (_, first) = next(iter(skips.reasons.items()))
        raise InputDataError(
            file, f"none of its {len(lines[tag])} {tag} records can be read: {reason}",
            "give a log with whole records", first,
        )  # fmt: skip
    sign = corrected.sign(lines, scans)
    if sign and not options.allow_corrected:
        raise InputDataError(
            file, f"its poses are a mapper's result, not odometry ({sign})",
            "give the raw log, or --allow-corrected to use them as odometry",
        )  # fmt: skip
    if sign:
        warnings.append(f"the poses are a mapper's result ({sign}), used as odometry")
    params = _params(lines)
    times = order.by_time(scans.stamps)
    warnings += times.warnings
    numbers = order.selection(times.times, options, file)
    rows = times.rows[numbers]
    mount = _mount(tag, scans, params, options, warnings)
    angle_min, angle_increment = _angles(scans, options)
    no_return, limits = _limits(scans, params, options)
    ranges = scans.ranges if np.array_equal(rows, np.arange(len(scans.stamps))) else scans.ranges[rows]
    mark_no_returns(ranges, limits)
    odometry = _odometry(tag, scans, times, lines, skips, warnings) if options.odometry else None
    truth_times, truth = _truth(lines, skips, warnings)
    return LaserLog(
        source=source,
        format="CARMEN",
        laser=tag,
        numbers=numbers,
        stamps=tuple(times.stamps[number] for number in numbers),
        times=times.times[numbers],
        ranges=ranges,
        angle_min=angle_min[rows],
        angle_increment=angle_increment[rows],
        mount=mount,
        odometry=None if odometry is None else odometry[numbers],
        no_return=no_return,
        range_limits=limits,
        report=LogReport(
            records={name: len(found) for name, found in lines.items()},
            skipped=skips.reasons,
            backward_stamps=times.backward,
            warnings=tuple(warnings),
        ),
        truth_times=truth_times,
        truth=truth,
    )


def _chosen_laser(lines: Lines, options: ReadingOptions, file: str, warnings: list[str]) -> str:
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
        return options.laser
    others = ", ".join(f"{tag} ({len(lines[tag])})" for tag in present[1:])
    if others:
        warnings.append(f"{present[0]} is used; --laser would choose {others}")
    return present[0]


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
    tag: str, scans: Scans, params: Mapping[str, float], options: ReadingOptions, warnings: list[str]
) -> Array:
    """The laser on the robot: as the user says, else from both poses of the record, else from PARAM.

    CARMEN: laser pose = robot pose ⊕ (offset, side offset, angular offset), for the rear laser too, whose
    angular offset is half a turn where the log gives none.
    """
    if options.mount is not None:
        return np.array(options.mount, dtype=np.float64)
    given = _param_mount(tag, params)
    if scans.robot.shape[1] and not np.array_equal(scans.laser, scans.robot):
        mount = mount_from_poses(scans.laser, scans.robot)
        if given is not None:
            off = np.abs(relative(mount, given))
            if max(off[0], off[1]) > 0.01 or off[2] > np.radians(0.5):
                warnings.append(
                    f"PARAM mounts the laser at {_said(given)}, the poses at {_said(mount)}: these hold"
                )
        return mount
    if given is not None:
        if scans.robot.shape[1] and given.any():
            warnings.append(f"both poses of {tag} are equal; the mounting is PARAM's, {_said(given)}")
        return given
    if tag in REAR:
        warnings.append("the log does not say how the rear laser is mounted: taken as turned by 180°")
        return np.array([0.0, 0.0, np.pi])
    if tag not in FRONT:
        warnings.append(
            f"the log does not say how {tag} is mounted: taken as at the robot's centre; see --mount"
        )
    return np.zeros(3)


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


def _angles(scans: Scans, options: ReadingOptions) -> tuple[Array, Array]:
    """First direction and step (S,) of each scan, rad."""
    by_count = {int(n): beam_angles(int(n)) for n in np.unique(scans.beams)}
    angles = np.array([by_count[int(n)] for n in scans.beams])
    if scans.head.shape[1]:
        known = scans.head[:, 3] != 0
        angles[known] = scans.head[known][:, (1, 3)]
    if options.angle_increment is not None:
        angles[:, 1] = options.angle_increment
    if options.angle_min is not None:
        angles[:, 0] = options.angle_min
    if options.flip:
        angles = -angles
    return angles[:, 0], angles[:, 1]


def _limits(
    scans: Scans, params: Mapping[str, float], options: ReadingOptions
) -> tuple[float | None, tuple[float, float]]:
    """The no-return value found, and the range limits in force (m)."""
    no_return = no_return_value(scans.ranges)
    high = CARMEN_MAX_RANGE
    if scans.head.shape[1] and (scans.head[:, 4] > 0).any():
        high = float(scans.head[:, 4].max())
    if params.get("robot_front_laser_max", 0) > 0:
        high = min(high, params["robot_front_laser_max"])
    if options.max_range is not None:
        high = options.max_range
    if no_return is not None:
        high = min(high, no_return)
    return no_return, (options.min_range or 0.0, high)


def _odometry(
    tag: str, scans: Scans, times: order.Order, lines: Lines, skips: Skips, warnings: list[str]
) -> Array | None:
    """Poses of the robot (S, 3) in order of time: the record's own, else of the ODOM lines around it."""
    if scans.robot.shape[1]:
        if len(times.rows) > 1 and not scans.robot.any():
            warnings.append("all poses are zero: taken as a log without odometry")
            return None
        poses = scans.robot[times.rows]
        poses[:, 2] = wrap(poses[:, 2])
        return poses
    values, stamps, _ = carmen_records.numbers(lines.get("ODOM", []), 6, skips)
    if not len(values):
        warnings.append(f"{tag} carries no pose and the log has no ODOM record: no odometry")
        return None
    moments = order.by_time(stamps)
    if times.nominal or moments.nominal:
        warnings.append(f"{tag} carries no pose, and the time stamps do not lead to ODOM's: no odometry")
        return None
    poses = values[moments.rows, :3]
    at = moments.times
    outside = int(np.sum((times.times < at[0]) | (times.times > at[-1])))
    if outside:
        warnings.append(f"{outside} scans lie before the first ODOM record or after the last")
    poses[:, 2] = np.unwrap(poses[:, 2])
    found = np.stack([np.interp(times.times, at, poses[:, axis]) for axis in range(3)], axis=-1)
    found[:, 2] = wrap(found[:, 2])
    return found


def _truth(lines: Lines, skips: Skips, warnings: list[str]) -> tuple[Array | None, Array | None]:
    """Times (T,) and true poses (T, 3) of the TRUEPOS records, sorted by time."""
    values, stamps, _ = carmen_records.numbers(lines.get("TRUEPOS", []), 6, skips)
    if not len(values):
        return None, None
    moments = order.by_time(stamps)
    if moments.nominal:
        warnings.append("the time stamps of TRUEPOS say nothing: no true poses")
        return None, None
    return moments.times, values[moments.rows, :3]
