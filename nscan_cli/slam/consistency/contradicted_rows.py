"""Scans that a repeated map puts where they do not fit, while they fit in the map: the repeat is wrong there.

Without odometry a fast turn or a bare wall can mislead the track. Such a repeat says nothing of the map.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.pairwise import PairOptions
from nscan_cli.ndt.energy import energy
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices, relative, wrap
from nscan_cli.slam.consistency.options import VerificationOptions
from nscan_cli.slam.consistency.repeated_maps import MappedPath


def contradicted_rows(
    log: LaserLog, path: MappedPath, repeat: MappedPath, options: VerificationOptions
) -> Indices:
    """The rows of scans that fit the scans around them clearly worse where the repeat puts them.

    Both paths have all scans of the log. A scan is compared with some before and behind it, some way or turn
    apart, where the paths differ.
    """
    spread = _spread_rows(path.poses, options)
    around = np.arange(-options.compared, options.compared + 1)
    places = np.searchsorted(spread, np.arange(len(log)))[:, np.newaxis] + around
    beside = spread[np.clip(places, 0, len(spread) - 1)]
    rows = np.broadcast_to(np.arange(len(log))[:, np.newaxis], beside.shape)
    ours, theirs = (
        relative(poses[rows.ravel()], poses[beside.ravel()]).reshape(*rows.shape, 3)
        for poses in (path.poses, repeat.poses)
    )
    off = ours - theirs
    differs = np.hypot(off[..., 0], off[..., 1]) + np.abs(wrap(off[..., 2])) > options.different_step
    found = []
    for row in np.flatnonzero(differs.any(axis=1)).tolist():
        gains = [
            _gain(log, int(beside[row, at]), row, ours[row, at], theirs[row, at])
            for at in np.flatnonzero(differs[row]).tolist()
        ]
        if np.mean(gains) > options.min_gain:
            found.append(row)
    return np.array(found, dtype=np.int64)


def _spread_rows(poses: Array, options: VerificationOptions) -> Indices:
    """Rows of scans that are some way or turn from the one before, along poses (S, 3)."""
    rows = [0]
    for row, (x, y, turn) in enumerate(poses.tolist()):
        there = poses[rows[-1]]
        is_far = np.hypot(x - there[0], y - there[1]) > options.compared_move
        if is_far or abs(float(wrap(turn - there[2]))) > options.compared_turn:
            rows.append(row)
    return np.array(rows, dtype=np.int64)


def _gain(log: LaserLog, first: int, last: int, ours: Array, theirs: Array) -> float:
    """By how much the energy of a point of the later scan is lower at one relative pose than at another."""
    before, behind = log.points(first), log.points(last)
    if not len(before) or not len(behind):
        return 0.0
    ndt = Ndt.of_scans(before, np.array([0, len(before)]), np.zeros((1, 3)), PairOptions())
    one, other = (energy(ndt, behind, pose).value for pose in (ours, theirs))
    return (other - one) / len(behind)
