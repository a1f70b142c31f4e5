"""Odometry whose steps are multiplied over some stretches of time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, are_known


def with_scaled_steps(log: LaserLog, stretches: Iterable[tuple[float, float]], factor: float) -> LaserLog:
    """The log with the lengths of its odometry's steps multiplied from one time (s) to another, each.

    The headings stay as they are.
    """
    assert log.odometry is not None
    some, path = list(stretches), log.odometry_path
    return replace(
        log,
        odometry=_scaled(log.times, log.odometry, some, factor),
        odometry_path=None
        if path is None
        else robot_path(path.times, _scaled(path.times, path.poses, some, factor)),
    )


def _scaled(times: Array, poses: Array, stretches: Iterable[tuple[float, float]], factor: float) -> Array:
    """Poses (S, 3) at times (S,), s, with the steps whose middle is within a stretch multiplied."""
    known = np.flatnonzero(are_known(poses))
    scaled, middle = poses.copy(), 0.5 * (times[known[1:]] + times[known[:-1]])
    steps = np.diff(poses[known, :2], axis=0)
    for begin, end in stretches:
        steps[(middle > begin) & (middle < end)] *= factor
    scaled[known[1:], :2] = poses[known[:1], :2] + np.cumsum(steps, axis=0)
    return scaled
