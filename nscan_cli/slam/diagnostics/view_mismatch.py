"""Scans that see other things than the keyframe beside which tracking has them.

Someone who walks along with the robot stands still as it sees him. Tracking can hold on to him while the
corridor goes by: the robot seems to stand, and half of its beams meet something else every second.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.frontend.options import BreakOptions
from nscan_cli.slam.frontend.view_similarity import BEARINGS, nearest_ranges, share_alike
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.threads import map_in_threads

AT_A_TIME = 256
"""Scans that a thread compares."""
TOGETHER = 10
"""Scans that are judged together: someone who comes close hides what was seen for a moment."""
LEAST = 0.25
"""In such a share of bearings scans see the same as their keyframe, on the average of those. It is 0.53 or
more in four real buildings, 0.40 outdoors, and 0.02 to 0.24 where someone walks along."""


class ViewMismatch(NamedTuple):
    """A stretch of scans that see other things."""

    first: int
    """Rows of its first scan and of its last."""
    last: int
    share: float
    """The least share of bearings in which scans that are judged together see the same as their keyframe."""


class KeyframeViews(NamedTuple):
    """Where tracking has scans, and the keyframes with their points."""

    poses: Array
    """(S, 3)"""
    rows: Indices
    """(K,) of the keyframes."""
    points: Array
    """(P, 2) of one keyframe after another, each in the robot's frame."""
    ends: Indices
    """(K + 1,) keyframe k has points[ends[k] : ends[k + 1]]."""


def view_mismatches(
    log: LaserLog,
    poses: Array,
    keyframes: list[Keyframe],
    reach: float,
    breaking: BreakOptions,
    threads: int = 1,
) -> ViewMismatch | None:
    """The first stretch of scans that see other things than the keyframe before them, and of it the worst.

    `poses` (S, 3) are those of all scans as tracked, `reach` (m) is how far points are matched. None where
    all scans see what they should.
    """
    if not keyframes:
        return None
    points = [keyframe.points for keyframe in keyframes]
    views = KeyframeViews(
        poses,
        np.array([keyframe.row for keyframe in keyframes], dtype=np.int64),
        np.concatenate(points),
        np.cumsum([0, *map(len, points)]),
    )
    bounds = breaking.view.tolerance, breaking.view.tolerance_per_metre
    shares = np.concatenate(
        map_in_threads(
            threads,
            lambda first: _shares(
                views, first, *log.points_of(slice(first, first + AT_A_TIME), reach), *bounds
            ),
            range(0, len(log), AT_A_TIME),
        )
    )
    told = np.flatnonzero(np.isfinite(shares))
    if len(told) < TOGETHER:
        return None
    means = np.convolve(shares[told], np.full(TOGETHER, 1 / TOGETHER), "valid")
    low = np.flatnonzero(means < LEAST)
    if not len(low):
        return None
    # Those that follow each other without a gap longer than what is judged together.
    end = int(np.append(np.flatnonzero(np.diff(low) > TOGETHER), len(low) - 1)[0])
    first, last = told[[low[0], low[end] + TOGETHER - 1]].tolist()
    return ViewMismatch(first, last, float(means[low[: end + 1]].min()))


@kernel
def _shares(
    views: KeyframeViews, first: int, points: Array, ends: Indices, apart: float, apart_per_metre: float
) -> Array:
    """(n,) in which share of bearings scans from row `first` on see the same as the keyframe before them.

    Scan k of them has points[ends[k] : ends[k + 1]]; nan for keyframes, and where too little tells.
    """
    shares, pose = np.full(len(ends) - 1, np.nan), np.empty(3)
    own, other = np.empty(BEARINGS), np.empty(BEARINGS)
    for k in range(len(shares)):
        row = first + k
        at = np.searchsorted(views.rows, row, side="right") - 1
        if at < 0 or views.rows[at] == row:
            continue
        relative_pose(views.poses[views.rows[at]], views.poses[row], pose)
        nearest_ranges(views.points[views.ends[at] : views.ends[at + 1]], pose, other)
        pose[:] = 0.0
        nearest_ranges(points[ends[k] : ends[k + 1]], pose, own)
        shares[k] = share_alike(own, other, apart, apart_per_metre)
    return shares
