"""A log with other odometry: mirrored, multiplied, or as if the laser were mounted elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.logs.assemble import scaled_odometry
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import MIRRORED, Array, are_known, compose, inverse


def with_changed_odometry(log: LaserLog, change: Callable[[Array, Array], Array]) -> LaserLog:
    """The log with all of its odometry changed: poses (P, 3) at times (P,), s. Without any it stays."""
    if log.odometry is None:
        return log
    path = log.odometry_path
    return replace(
        log,
        odometry=change(log.odometry, log.times),
        odometry_path=None if path is None else robot_path(path.times, change(path.poses, path.times)),
    )


def with_mirrored_odometry(log: LaserLog, mount: Array) -> LaserLog:
    """The log whose laser moves as the mirror image of one mounted at (3,) on the robot that moves by
    odometry: readings in the wrong order show it so."""
    return with_changed_odometry(
        log, lambda poses, _times: compose(compose(poses, mount) * MIRRORED, inverse(log.mount))
    )


def with_seen_mount(log: LaserLog, mount: Array) -> LaserLog:
    """The log whose laser moves as if it were mounted at (3,) on the robot that moves by odometry.

    The robot's own path is where the mounting of the file has it then.
    """
    return with_changed_odometry(
        log, lambda poses, _times: compose(compose(poses, mount), inverse(log.mount))
    )


def with_scaled_odometry(log: LaserLog, scale: float) -> LaserLog:
    """The log with the lengths of its odometry multiplied by `scale`."""
    return with_changed_odometry(log, lambda poses, _times: scaled_odometry(poses, scale))


def with_scaled_steps(log: LaserLog, stretches: Sequence[tuple[float, float]], factor: float) -> LaserLog:
    """The log with the lengths of its odometry's steps multiplied from one time (s) to another, each.

    A step is in a stretch if its middle is. The headings stay as they are.
    """

    def scaled(poses: Array, times: Array) -> Array:
        known = np.flatnonzero(are_known(poses))
        changed, middle = poses.copy(), 0.5 * (times[known[1:]] + times[known[:-1]])
        steps = np.diff(poses[known, :2], axis=0)
        for begin, end in stretches:
            steps[(middle > begin) & (middle < end)] *= factor
        changed[known[1:], :2] = poses[known[:1], :2] + np.cumsum(steps, axis=0)
        return changed

    return with_changed_odometry(log, scaled)
