"""Odometry as a mirror image: readings in the wrong order show the laser moving so."""

from __future__ import annotations

from dataclasses import replace

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import MIRRORED, Array, compose, inverse


def with_mirrored_odometry(log: LaserLog) -> LaserLog:
    """The log whose laser, on a robot that moves by odometry, moves as the mirror image of what it did."""
    assert log.odometry is not None
    path = log.odometry_path
    return replace(
        log,
        odometry=_mirrored(log.odometry, log.mount),
        odometry_path=None if path is None else robot_path(path.times, _mirrored(path.poses, log.mount)),
    )


def _mirrored(poses: Array, mount: Array) -> Array:
    """Poses (S, 3) of the robot whose laser, mounted at (3,), is at the mirror images of where it was."""
    return compose(compose(poses, mount) * MIRRORED, inverse(mount))
