"""The final poses of all scans, which follow the correction of the keyframes on either side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.logs.robot_path import bent_between
from nscan_cli.poses import Array, Indices, wrap
from nscan_cli.slam.backend.options import OptimisationOptions


def between_keyframes(
    tracked: Array,
    keyframes: Indices,
    poses: Array,
    breaks: Sequence[int] = (),
    metres_per_radian: float = OptimisationOptions.metres_per_radian,
) -> Array:
    """(S, 3) poses of all scans: tracked poses (S, 3) that are moved with the keyframes (K,) on either side,
    blended.

    `poses` (K, 3) are the keyframes' global poses. The nearer keyframe along the path has the larger weight,
    so that the path bends smoothly. At the `breaks` of the track, which are keyframes, the path is cut: the
    scans before belong to the keyframe before. A turn by 1 rad counts as `metres_per_radian` (m) of path.
    """
    scans = np.arange(len(tracked))
    before = np.searchsorted(keyframes, scans, side="right") - 1
    after = np.minimum(before + 1, len(keyframes) - 1)
    step = np.diff(tracked, axis=0)
    wear = np.hypot(step[:, 0], step[:, 1]) + metres_per_radian * np.abs(wrap(step[:, 2]))
    path = np.concatenate([[0.0], np.cumsum(wear)])
    start, length = path[keyframes[before]], path[keyframes[after]] - path[keyframes[before]]
    bends = (length > 0.0) & ~np.isin(keyframes[after], list(breaks))
    share = np.divide(path - start, length, out=np.zeros(len(path)), where=bends)
    return bent_between(tracked, tracked[keyframes], poses, (before, after), share)
