"""What of a log is not believed: steps of odometry that no robot could drive, and a laser that hangs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative

MOVES = 1e-3
"""Less than this (m, rad) is no motion."""
USUAL = 0.99
"""The quantile of the steps that tells how far the robot goes from scan to scan."""
TIMES = 5.0
"""A step so many times as far is not believed,"""
LEAST = 1.0
"""and farther than this (m, rad): less a match finds by itself."""
SOME = 16
"""Every so-manyth beam is compared first."""


def believed_odometry(odometry: Array, times: Array) -> tuple[Array, NDArray[np.int64]]:
    """Odometry (S, 3) without its jumps, and the rows (J,) to which it jumped; times (S,) in s.

    Where it is reset, wraps round or has a wrong value, the robot is taken to drive on as in the step
    before, and what follows goes on from there. After a pause a robot may have come as much farther.
    """
    jumps = jumps_of(odometry, times)
    if not len(jumps):
        return odometry, jumps
    steps, mended = relative(odometry[1:], odometry[:-1]), odometry.copy()
    jumped = np.isin(np.arange(1, len(odometry)), jumps)
    for row, jump in enumerate(jumped.tolist()):
        if jump:
            steps[row] = steps[row - 1] if row else 0.0
        mended[row + 1] = compose(mended[row], steps[row])
    return mended, jumps


def jumps_of(poses: Array, times: Array | None = None) -> NDArray[np.int64]:
    """The rows (J,) to which poses (S, 3) jump, by more than the robot goes in all its other steps.

    With times (S,) in s it may go as much farther in a pause.
    """
    if len(poses) < 2:
        return np.zeros(0, dtype=np.int64)
    steps, pauses = relative(poses[1:], poses[:-1]), np.ones(len(poses) - 1)
    if times is not None:
        periods = np.diff(times)
        pauses = np.maximum(periods / max(float(np.median(periods)), MOVES), 1.0)
    jumps = np.zeros(len(steps), dtype=np.bool_)
    for size in (np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])):
        moving = size[size > MOVES]
        if len(moving):
            jumps |= size > np.maximum(TIMES * np.quantile(moving, USUAL, method="lower"), LEAST) * pauses
    return np.flatnonzero(jumps) + 1


def hanging(log: LaserLog, odometry: Array | None) -> NDArray[np.int64]:
    """The rows (H,) whose readings repeat those before to the last digit, though the robot moves.

    `odometry` (S, 3) is what is believed of it; without any, a robot that stands sees the same.
    """
    if odometry is None or len(log) < 2:
        return np.zeros(0, dtype=np.int64)
    return repeating(log, np.abs(relative(odometry[1:], odometry[:-1])).max(axis=1) > MOVES)


def repeating(log: LaserLog, moves: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Of the rows to which the robot `moves` (S − 1,), those (H,) whose readings repeat those before."""
    # A few beams tell nearly all of them apart.
    rows = np.flatnonzero(moves & _same(log.ranges[:, ::SOME])) + 1
    repeats = np.array([_same(log.ranges[row - 1 : row + 1])[0] for row in rows.tolist()], dtype=np.bool_)
    return rows[repeats & np.isfinite(log.ranges[rows]).any(axis=1)]


def _same(ranges: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(S − 1,) whether the readings (S, B) of a scan are all those of the one before."""
    one, other = ranges[1:], ranges[:-1]
    same: NDArray[np.bool_] = ((one == other) | (np.isnan(one) & np.isnan(other))).all(axis=1)
    return same
