"""The final poses of all scans, which follow the correction of the keyframes on either side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.poses import Array, Indices, compose, relative, wrap
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

    `poses` (K, 3) are the keyframes' global poses. If the graph moved two keyframes against each other, a
    scan between them has two poses, one as seen from each. The nearer keyframe along the path has the larger
    weight, so that the path bends smoothly. At the `breaks` of the track, which are keyframes, the path is
    cut: the scans before belong to the keyframe before. A turn by 1 rad counts as `metres_per_radian` (m) of
    path.
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
    from_before = compose(poses[before], relative(tracked, tracked[keyframes[before]]))
    from_after = compose(poses[after], relative(tracked, tracked[keyframes[after]]))
    apart = from_after - from_before
    apart[:, 2] = wrap(apart[:, 2])
    blended: Array = from_before + share[:, None] * apart
    blended[:, 2] = wrap(blended[:, 2])
    return blended
