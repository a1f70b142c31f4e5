"""Odometry that is changed to agree with the scans, until it is known what of the file is wrong."""

from __future__ import annotations

from collections.abc import Sequence

from nscan_cli.calibration.changed_odometry import with_scaled_odometry, with_seen_mount
from nscan_cli.calibration.findings import Finding
from nscan_cli.logs.laser_log import LaserLog


def agreeing(log: LaserLog, findings: Sequence[Finding]) -> LaserLog:
    """The log whose odometry agrees with the scans, as findings see it that leave open what is wrong."""
    for finding in findings:
        if finding.seen_scale is not None:
            log = with_scaled_odometry(log, finding.seen_scale)
        if finding.seen_mount is not None:
            log = with_seen_mount(log, finding.seen_mount)
    return log
