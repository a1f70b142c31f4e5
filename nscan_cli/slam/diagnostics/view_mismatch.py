"""Scans that see other things than the keyframe beside which tracking has them.

Someone who walks along with the robot seems to stand still. Tracking can hold on to him while the corridor
passes by. Then the robot seems to stand, too, and half of its beams meet other things every second.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.diagnostics.options import ViewMismatchOptions
from nscan_cli.slam.frontend.break_options import ViewSimilarityOptions
from nscan_cli.slam.frontend.view_similarity import nearest_ranges, share_alike
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.threads import map_in_threads

SCANS_PER_THREAD = 256
"""Scans that a thread compares at a time."""


class ViewMismatch(NamedTuple):
    """A stretch of scans that see other things."""

    first: int
    """Row of its first scan."""
    last: int
    """Row of its last scan."""
    share: float
    """Least mean share of sectors in which scans judged together see the same as their keyframe."""


class KeyframeViews(NamedTuple):
    """The poses of scans by tracking, and the keyframes with their points."""

    poses: Array
    """(S, 3)"""
    rows: Indices
    """(K,) rows of the keyframes."""
    points: Array
    """(P, 2) points of one keyframe after another, each in the robot's frame."""
    ends: Indices
    """(K + 1,) keyframe k has points[ends[k] : ends[k + 1]]."""


def view_mismatches(
    log: LaserLog,
    poses: Array,
    keyframes: list[Keyframe],
    max_range: float,
    similarity: ViewSimilarityOptions,
    options: ViewMismatchOptions,
    threads: int = 1,
) -> ViewMismatch | None:
    """The first stretch of scans that see other things than the keyframe before them; None without any.

    `poses` (S, 3) are those of all scans as tracked, `max_range` (m) is that of the points that are matched.
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
    shares = np.concatenate(
        map_in_threads(
            threads,
            lambda first: _shares(
                views, first, *log.batch_points(slice(first, first + SCANS_PER_THREAD), max_range), similarity
            ),
            range(0, len(log), SCANS_PER_THREAD),
        )
    )
    told = np.flatnonzero(np.isfinite(shares))
    together = options.scans
    if len(told) < together:
        return None
    means = np.convolve(shares[told], np.full(together, 1 / together), "valid")
    low = np.flatnonzero(means < options.min_similarity)
    if not len(low):
        return None
    # The first run of them, without a gap longer than what is judged together.
    end = int(np.append(np.flatnonzero(np.diff(low) > together), len(low) - 1)[0])
    first, last = told[[low[0], low[end] + together - 1]].tolist()
    return ViewMismatch(first, last, float(means[low[: end + 1]].min()))


@kernel
def _shares(
    views: KeyframeViews, first: int, points: Array, ends: Indices, options: ViewSimilarityOptions
) -> Array:
    """(n,) the share of sectors in which scans from row `first` on see the same as the keyframe before them.

    Scan k of them has points[ends[k] : ends[k + 1]]; nan for keyframes, and where too few can be compared.
    """
    shares, pose = np.full(len(ends) - 1, np.nan), np.empty(3)
    own, other = np.empty(options.sectors), np.empty(options.sectors)
    at = -1
    for k in range(len(shares)):
        row = first + k
        while at + 1 < len(views.rows) and views.rows[at + 1] <= row:
            at += 1
        if at < 0 or views.rows[at] == row:
            continue
        relative_pose(views.poses[views.rows[at]], views.poses[row], pose)
        nearest_ranges(views.points[views.ends[at] : views.ends[at + 1]], pose, other)
        pose[:] = 0.0
        nearest_ranges(points[ends[k] : ends[k + 1]], pose, own)
        shares[k] = share_alike(own, other, options)
    return shares
