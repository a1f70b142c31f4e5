"""Odometry changed to agree with what the scans show, where it is open whether it or the file is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from nscan_cli.logs.assemble import scaled_odometry
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import MIRRORED, Array, compose, inverse


def with_mirrored_odometry(log: LaserLog) -> LaserLog:
    """The log whose laser, on a robot that moves by odometry, moves as the mirror image of what it did:
    readings in the wrong order show it so."""
    mount = log.mount
    return _with_changed(log, lambda poses: compose(compose(poses, mount) * MIRRORED, inverse(mount)))


def with_seen_mount(log: LaserLog, mount: Array) -> LaserLog:
    """The log whose laser moves as if it were mounted at (3,) on the robot that moves by odometry.

    The robot's own path is where the mounting of the file has it then.
    """
    return _with_changed(log, lambda poses: compose(compose(poses, mount), inverse(log.mount)))


def with_scaled_odometry(log: LaserLog, scale: float) -> LaserLog:
    """The log with the lengths of its odometry multiplied by `scale`."""
    return _with_changed(log, lambda poses: scaled_odometry(poses, scale))


def _with_changed(log: LaserLog, change: Callable[[Array], Array]) -> LaserLog:
    """The log with all poses (S, 3) of its odometry changed."""
    assert log.odometry is not None
    path = log.odometry_path
    return replace(
        log,
        odometry=change(log.odometry),
        odometry_path=None if path is None else robot_path(path.times, change(path.poses)),
    )
