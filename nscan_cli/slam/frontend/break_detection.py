"""What a break of the track is: a scan that contradicts the map and sees other things than the scan before.

A robot that is lifted and put down elsewhere sees what no match with the local map explains. The tracker
takes the best match all the same. The views of two scans from nearly the same place give it away.
Here are the tests; segment_tracker.py takes the final decision, after the scans behind the doubted one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import relative, transform
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.tracked_scans import TrackedBatch
from nscan_cli.slam.frontend.view_similarity import view_similarity


def contradicts_map(scan: TrackedBatch, usual: float, options: BreakOptions) -> bool:
    """Whether a scan contradicts the map, and is not just matched a little worse than all others.

    `usual` is the share of inliers that scans before it had.
    """
    drop = usual - float(scan.tracked.inliers[0])
    return usual >= options.min_usual_inliers and drop >= options.min_inlier_drop


def was_carried(scan: TrackedBatch, before: TrackedBatch, options: BreakOptions) -> bool:
    """Whether a scan sees other things than the one `before`, though odometry stood meanwhile."""
    if scan.scans.odometry is None or before.scans.odometry is None:
        return False
    step = relative(scan.scans.odometry[0], before.scans.odometry[0])
    drop = float(before.tracked.inliers[0]) - float(scan.tracked.inliers[0])
    # Without odometry a step is nan.
    stood = np.hypot(step[0], step[1]) < options.stood and abs(step[2]) < options.stood
    share = _share_alike(scan, before, options) if stood and drop >= options.min_inlier_drop else None
    return share is not None and share < options.carried_similarity


def sees_the_same(scan: TrackedBatch, seen: TrackedBatch, options: BreakOptions) -> bool:
    """Whether a scan sees what another, settled one saw."""
    share = _share_alike(scan, seen, options)
    return share is not None and share >= options.min_similarity


def _share_alike(scan: TrackedBatch, seen: TrackedBatch, options: BreakOptions) -> float | None:
    """The share of sectors in which the views of two scans are the same, where they were found."""
    step = relative(seen.tracked.poses[0], scan.tracked.poses[0])
    return view_similarity(scan.scans.of(0), transform(step, seen.scans.of(0)), options.view)


def see_enough(batch: TrackedBatch, options: BreakOptions) -> NDArray[np.bool_]:
    """(n,) which of the scans have points enough to compare views."""
    return np.diff(batch.scans.ends) >= options.view.min_sectors


def count_undoubted(batch: TrackedBatch, seen_before: TrackedBatch | None, options: BreakOptions) -> int:
    """The number of scans, from the first on, that are matched well or see what was seen before.

    `seen_before` is the last settled scan with points enough to compare views.
    """
    poor = batch.tracked.inliers < options.poor_inliers
    if not poor.any():
        return len(batch)
    enough = see_enough(batch, options)
    for k in np.flatnonzero(poor & enough).tolist():
        before = np.flatnonzero(enough[:k])
        seen = batch.one(int(before[-1])) if len(before) else seen_before
        if seen is not None and not sees_the_same(batch.one(k), seen, options):
            return int(k)
    return len(batch)


def is_bridged_by_odometry(scan: TrackedBatch, before: TrackedBatch | None, options: BreakOptions) -> bool:
    """Whether odometry bridges the way to a scan that may well see other things: scans are missing."""
    if before is None or before.scans.odometry is None or scan.scans.odometry is None:
        return False
    step = relative(scan.scans.odometry[0], before.scans.odometry[0])
    return bool(np.hypot(step[0], step[1]) > options.bridged_distance or abs(step[2]) > options.bridged_turn)
