"""Odometry of a text log whose poses are in records of their own, beside the scans."""

from __future__ import annotations

from nscan_cli.logs.assemble import ReaderFindings
from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.scan_order import ScanOrder
from nscan_cli.poses import Array


def odometry_of_scans(
    scans: ScanOrder, poses: Array, options: ReadingOptions, findings: ReaderFindings
) -> Array | None:
    """Poses (S, 3) at the times of the scans from those (S, 3) in the records of the scans, or None.

    They are at the same times, unless an option says that the odometry's clock is off.
    """
    if not options.clock_offset or scans.nominal:
        return poses
    at = scans.times + options.clock_offset
    return interpolated_poses(scans.times, at, poses, "pose in a scan", findings.warnings)


def odometry_of_records(
    scans: ScanOrder,
    records: ScanOrder,
    poses: Array,
    name: str,
    origin: str,
    options: ReadingOptions,
    findings: ReaderFindings,
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
    at = records.times + options.clock_offset
    found = interpolated_poses(scans.times, at, poses, name, warnings)
    used["odometry"] = "none: at other times" if found is None else origin
    return found
