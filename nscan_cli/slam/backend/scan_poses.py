"""The poses of all scans from those of the keyframes: what the graph corrects, all scans in between share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array, compose, relative, wrap
from nscan_cli.slam.backend.options import OptimisationOptions


def between_keyframes(
    tracked: Array,
    keyframes: NDArray[np.int64],
    poses: Array,
    breaks: Sequence[int] = (),
    metres_per_radian: float = OptimisationOptions.metres_per_radian,
) -> Array:
    """(S, 3) poses of all scans: as tracked (S, 3) from the keyframes (K,) on either side, blended.

    `poses` (K, 3) are the keyframes' global poses. Seen from the keyframe before and from the one after,
    a scan has two poses when the graph moved the two against each other. The closer one on the path
    counts for more, so that the path bends and does not break at a keyframe. Over the `breaks` of the
    track, which are keyframes, it does: the scans before belong to the keyframe before. A turn by 1 rad
    counts as `metres_per_radian` (m) of path.
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
