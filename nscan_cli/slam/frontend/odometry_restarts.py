"""Where odometry begins again: another drive in the log, or a robot that was switched off and carried."""

from __future__ import annotations

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices, Mask, are_known, relative
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.odometry_checks import OdometryCheckOptions
from nscan_cli.slam.frontend.view_similarity import view_similarity


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
