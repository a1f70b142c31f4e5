"""Odometry of a text log: headings in radians, and poses in the scans or in records of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.logs.assemble import ReaderFindings
from nscan_cli.logs.heading_unit import HeadingUnitOptions, are_in_degrees
from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.logs.scan_order import ScanOrder
from nscan_cli.poses import Array, Indices, wrap

HEADINGS_CONVERTED = (
    "the headings of odometry are in degrees, for the robot then drives along them: they are converted to "
    "radians; --as-recorded takes them as radians"
)


def headings_in_radians(columns: Sequence[Array], rows: Indices, findings: ReaderFindings) -> None:
    """Convert headings in degrees to radians, in place, and say so.

    `columns` (R, 3) are the poses of the robot, as written, which in `rows` (R,) are in order of time, and
    other poses beside them.
    """
    robot, most, options = columns[0], HeadingUnitOptions.max_radians, findings.options
    if options.as_recorded or not options.odometry or not robot.shape[1] or not are_in_degrees(robot[rows]):
        return
    for poses in columns:
        if np.abs(poses[:, 2]).max() > most:
            poses[:, 2] = np.radians(poses[:, 2])
    findings.contradictions.append(HEADINGS_CONVERTED)


def odometry_of_scans(scans: ScanOrder, robot: Array, origin: str, findings: ReaderFindings) -> Array | None:
    """Poses (S, 3) at the times of the scans from those (S, 3) in their records, in file order, or None.

    They are at the same times, unless an option says that the odometry's clock is off.
    """
    findings.used["odometry"] = origin
    poses = robot[scans.rows]
    poses[:, 2] = wrap(poses[:, 2])
    offset = findings.options.clock_offset
    if not offset or scans.nominal:
        return poses
    at = scans.times + offset
    return interpolated_poses(scans.times, at, poses, "pose in a scan", findings.warnings)


def odometry_of_records(
    scans: ScanOrder, records: ScanOrder, poses: Array, name: str, origin: str, findings: ReaderFindings
) -> Array | None:
    """Poses (S, 3) at the times of the scans from poses (P, 3) of records in order of time, or None.

    `name` is what warnings call such records, `origin` what the report says about an odometry from them.
    """
    used, warnings = findings.used, findings.warnings
    if not len(poses):
        used["odometry"] = "none: no pose in the log"
        warnings.append(f"the log has no {name}: no odometry")
        return None
    if scans.nominal or records.nominal:
        used["odometry"] = "none: no time stamps"
        warnings.append(f"the time stamps do not match the scans with a {name}: no odometry")
        return None
    at = records.times + findings.options.clock_offset
    found = interpolated_poses(scans.times, at, poses, name, warnings)
    used["odometry"] = "none: at other times" if found is None else origin
    return found
