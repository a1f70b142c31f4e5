"""A log whose odometry has other stamps: all of them, or those of a part, moved by some seconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.odometry_interpolation import interpolated_poses, moved_odometry
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.logs.scan_order import nearest_in_time
from nscan_cli.poses import Array, Mask, are_known


def with_delay(log: LaserLog, delay: float) -> LaserLog:
    """The log with `delay` (s) added to the stamps of its odometry."""
    return _with_moved_stamps(log, lambda times: (times + delay, np.ones(len(times), dtype=bool)))


def with_moved_part(
    log: LaserLog, time: float, by: float, is_behind: bool, unsure: tuple[float, float] = (0.0, 0.0)
) -> LaserLog:
    """The log with `by` (s) added to the stamps of its odometry behind a time (s), or before it.

    From a time to another where it is `unsure` which it is, poses are left out: some would be far off.

    Of poses that come to lie beside those of the other part, the later ones are left out.
    """

    def moved(times: Array) -> tuple[Array, Mask]:
        there = times + np.where((times > time) == is_behind, by, 0.0)
        latest = np.maximum.accumulate(there)
        is_sure = (times <= unsure[0]) | (times >= unsure[1])
        is_later: Mask = np.append(True, there[1:] > latest[:-1])
        return there, is_later & is_sure

    return _with_moved_stamps(log, moved)


def _with_moved_stamps(log: LaserLog, moved: Callable[[Array], tuple[Array, Mask]]) -> LaserLog:
    """The log with its odometry at other times: those (P,) that `moved` gives for times (P,), s, and which of
    them are used."""
    if log.odometry is None:
        return log
    times, poses = log.known_odometry()
    at, used = moved(times)
    at, poses = at[used], poses[used]
    if log.odometry_path is None:
        return replace(log, odometry=interpolated_poses(log.times, at, poses, "pose", []))
    path = robot_path(at, poses)
    if path is None:
        return log
    # Where odometry was left out it stays so, at its own times.
    there, _ = moved(log.times)
    order = np.argsort(there, kind="stable")
    is_known = are_known(log.odometry)[order[nearest_in_time(there[order], log.times)]]
    return replace(log, odometry=moved_odometry(is_known, path, log.times), odometry_path=path)
