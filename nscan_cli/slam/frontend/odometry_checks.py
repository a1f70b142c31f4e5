"""What is not trusted in a log: odometry steps that no robot could drive, and scans of a frozen laser.

Odometry begins again with another drive in the log, or if the robot was switched off and carried.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.copies import repeat_reading
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices, Mask, are_known, compose, relative
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.odometry_stalls import OdometryStallOptions
from nscan_cli.slam.frontend.view_similarity import view_similarity

SHORTEST_PERIOD = 1e-3
"""s; a median period is at least this, to divide by."""
REPEATED_RETURNS = 5
"""Least number of returns of a scan that repeats the one before: the same two or three come by chance."""
NO_ROWS: Indices = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class OdometryCheckOptions:
    """Which steps of the odometry, or of the scans, are jumps that no robot drives."""

    min_motion: float = 1e-3
    """Least step that counts as motion, m and rad. A larger value ignores slow drives."""
    step_quantile: float = 0.99
    """Quantile of the log's steps that is the usual longest step. A larger value finds fewer jumps."""
    jump_factor: float = 5.0
    """A jump is longer than this multiple of the usual longest step. A larger value finds fewer jumps."""
    min_jump: float = 1.0
    """A jump is longer than this, m and rad: a match corrects a smaller one by itself. A larger value finds
    fewer jumps."""
    stalls: OdometryStallOptions = field(default_factory=OdometryStallOptions)
    """When odometry stood still, and then made up for it in one step."""


def without_jumps(
    odometry: Array, times: Array, options: OdometryCheckOptions, restarts: Indices = NO_ROWS
) -> tuple[Array, NDArray[np.int64]]:
    """Odometry (S, 3) without its jumps, and the rows (J,) to which it jumped; times (S,) in s.

    `restarts` (R,) are rows to which it jumps, however long the pause before. Odometry is nan where it is
    missing; no step leads to such a row or from it.

    Where it is reset, wraps round or has a wrong value, the step before takes the place of the jump.
    """
    jumps = np.union1d(jumps_of(odometry, options, times), restarts)
    if not len(jumps):
        return odometry, jumps
    steps, mended = relative(odometry[1:], odometry[:-1]), odometry.copy()
    jumped, known = np.isin(np.arange(1, len(odometry)), jumps), are_known(odometry)
    for row, jump in enumerate(jumped.tolist()):
        if jump:
            steps[row] = steps[row - 1] if row and known[row - 1] else 0.0
        if known[row] and known[row + 1]:
            mended[row + 1] = compose(mended[row], steps[row])
    return mended, jumps


def jumps_of(poses: Array, options: OdometryCheckOptions, times: Array | None = None) -> NDArray[np.int64]:
    """The rows (J,) to which poses (S, 3) jump, by more than the robot goes in all its other steps.

    With times (S,) in s, a step after a pause may be longer in proportion.
    """
    if len(poses) < 2:
        return np.zeros(0, dtype=np.int64)
    steps, pauses = relative(poses[1:], poses[:-1]), np.ones(len(poses) - 1)
    if times is not None:
        periods = np.diff(times)
        pauses = np.maximum(periods / max(float(np.median(periods)), SHORTEST_PERIOD), 1.0)
    lengths, turns = np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])
    jumps = _long(lengths, pauses, True, options) | _long(turns, pauses, False, options)
    return np.flatnonzero(jumps) + 1


def _long(sizes: Array, pauses: Array, is_length: bool, options: OdometryCheckOptions) -> Mask:
    """(n,) which steps, of sizes (n,) in m or rad, are longer than the others; after a pause, given as a
    multiple (n,) of the usual one, they may be longer in proportion.

    A robot that drives as far in a step as it can does so in the step before or behind, too. So a length
    counts as no more than the larger one of these: one that jumps now and then is no usual length. A turn may
    take a single step. Without the jumps that are found the usual longest step may be shorter, and others are
    jumps, too.
    """
    jumps: Mask = np.zeros(len(sizes), dtype=np.bool_)
    while True:
        moving = sizes[(sizes > options.min_motion) & ~jumps]
        if not len(moving):
            return jumps
        usual = _as_beside(moving) if is_length else moving
        longest = np.quantile(usual, options.step_quantile, method="lower")
        found = jumps | (sizes > max(options.jump_factor * longest, options.min_jump) * pauses)
        if (found == jumps).all():
            return jumps
        jumps = found


def _as_beside(sizes: Array) -> Array:
    """(n,) sizes of successive steps, each no larger than the larger one of those beside it.

    Two of them, or one, tell nothing of each other.
    """
    if len(sizes) < 3:
        return sizes
    beside = np.zeros_like(sizes)
    beside[1:] = sizes[:-1]
    beside[:-1] = np.maximum(beside[:-1], sizes[1:])
    found: Array = np.minimum(sizes, beside)
    return found


def frozen_scans(log: LaserLog, odometry: Array | None, options: OdometryCheckOptions) -> NDArray[np.int64]:
    """The rows (H,) whose readings repeat those before exactly, though the robot moves by odometry (S, 3).

    There are none without odometry: a robot that stands sees the same.
    """
    if odometry is None or len(log) < 2:
        return np.zeros(0, dtype=np.int64)
    moves = np.abs(relative(odometry[1:], odometry[:-1])).max(axis=1) > options.min_motion
    return repeated_scans(log, moves)


def repeated_scans(log: LaserLog, moves: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The rows (H,) whose readings repeat those before, among the rows to which the robot `moves` (S −
    1,)."""
    rows = np.flatnonzero(moves & repeat_reading(log.ranges)[1:]) + 1
    returns = np.count_nonzero(np.isfinite(log.ranges[rows]), axis=1)
    repeated: Indices = rows[returns >= min(REPEATED_RETURNS, log.ranges.shape[1])]
    return repeated


def restarts_of(log: LaserLog, options: OdometryCheckOptions, breaks: BreakOptions) -> Indices:
    """The rows (J,) at which odometry begins again, at its first pose or at zero, from afar.

    No robot comes back so exactly, however long the pause before. But it may well stand at its first pose if
    it sees what the first scan saw: drives may begin at one place.
    """
    odometry = log.odometry
    known = np.zeros(0, dtype=np.int64) if odometry is None else np.flatnonzero(are_known(odometry))
    if odometry is None or len(known) < 2:
        return known[:0]
    first, last = odometry[known[[0, -1]]]
    is_first, is_begin = _is_at(odometry, first, options), _is_at(odometry, np.zeros(3), options)
    if np.abs(relative(first, last)).max() <= options.min_jump:
        # It goes on there: the clock was set back, and what was recorded first comes last.
        is_begin &= is_first
    is_far = np.abs(relative(odometry[1:], odometry[:-1])).max(axis=1) > options.min_jump
    rows, begin = np.flatnonzero((is_first | is_begin)[1:] & is_far) + 1, int(known[0])
    kept = [row for row in rows.tolist() if not (is_first[row] and _see_the_same(log, begin, row, breaks))]
    return np.array(kept, dtype=np.int64)


def _is_at(odometry: Array, pose: Array, options: OdometryCheckOptions) -> Mask:
    """(S,) which poses (S, 3) are the pose (3,)."""
    there: Mask = np.abs(relative(odometry, pose)).max(axis=1) < options.min_motion
    return there


def _see_the_same(log: LaserLog, row: int, other: int, breaks: BreakOptions) -> bool:
    """Whether scans see the same if the robot is at one place, or see too little to tell."""
    share = view_similarity(log.points(row), log.points(other), breaks.view)
    return share is None or share >= breaks.min_similarity
