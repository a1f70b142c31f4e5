"""Single scans that jump away and back while odometry goes on evenly.

Tracking decides where a scan is before it knows the next ones. With the scans on both sides, such a one is
put where both of them lead.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.logs.robot_path import bent_between
from nscan_cli.poses import Array, Indices, relative, wrap
from nscan_cli.slam.backend.options import SingleScanOptions


def without_single_jumps(
    tracked: Array, odometry: Array | None, keyframes: Indices, options: SingleScanOptions
) -> Array:
    """(S, 3) tracked poses (S, 3), with single scans that jump to and fro moved between their neighbours.

    Keyframes, which are matched on their own, stay. Without odometry (S, 3) all do.
    """
    if odometry is None or len(tracked) < 3:
        return tracked
    steps, by_odometry = (relative(path[1:], path[:-1]) for path in (tracked, odometry))
    off = steps - by_odometry
    off[:, 2] = wrap(off[:, 2])
    jump, turn = (_sizes(np.diff(each, axis=0), options) for each in (steps, by_odometry))
    returns = _sizes(off[1:] + off[:-1], options) < options.max_return * _sizes(np.diff(off, axis=0), options)
    lengths = _sizes(by_odometry, options)
    is_near = np.maximum(lengths[1:], lengths[:-1]) < options.max_step
    is_off = is_near & (jump > options.min_jump) & (turn < options.max_share * jump) & returns
    rows = np.setdiff1d(np.flatnonzero(is_off) + 1, keyframes)
    found, beside = tracked.copy(), (rows - 1, rows + 1)
    found[rows] = bent_between(odometry[rows], odometry, tracked, beside, np.full(len(rows), 0.5))
    return found


def _sizes(steps: Array, options: SingleScanOptions) -> Array:
    """(n,) sizes of differences of poses (n, 3), m."""
    return np.sqrt(steps[:, 0] ** 2 + steps[:, 1] ** 2 + (options.metres_per_radian * steps[:, 2]) ** 2)
