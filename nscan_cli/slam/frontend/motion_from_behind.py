"""Step 1 without odometry: scans that fit badly or tell little are tracked from behind, too.

Few beams hit a wall far ahead, too few for a Gaussian. So a robot that drives off, or drives as its log
begins, seems to stand until the wall is near. From behind, the wall is near first, and its Gaussians hold the
scans before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker


class MotionFromBehind(NamedTuple):
    """How the robot moved where the track from behind fits better."""

    poses: Array
    """(n, 3); nan elsewhere."""
    weakest_sigmas: Array
    """(n,) standard deviation of the positions that the scans measure, m; 0 elsewhere."""


def motion_from_behind(
    scans: ScanBatch, found: TrackedScans, tracker: Tracker, options: TrackingOptions
) -> MotionFromBehind | None:
    """The motion of scans (n) as `tracker`, a new one, finds it from the last to the first.

    It is known in stretches where the robot, as it was `found`, seems to stand, and where scans from behind
    fit clearly better, with a longer way. None without such stretches. The scans stay as they are.
    """
    doubtful = doubtful_stretches(found, options)
    stretches = [each for each in doubtful if _seems_to_stand(found.poses, *each, options)]
    if not stretches:
        return None
    # Where scans tell the motion, it leads from behind, too.
    known = found.poses.copy()
    for first, end in doubtful:
        known[first:end] = np.nan
    behind = tracker.track(scans.backwards(known))
    inliers, poses, sigmas = behind.inliers[::-1], behind.poses[::-1], behind.weakest_sigmas[::-1]
    # What scans tell from one side alone may be the ripple of their walls.
    tells = sigmas <= options.scan.degeneracy.trusted_sigma
    sigmas = np.where(tells, sigmas, np.maximum(sigmas, found.weakest_sigmas))
    motion = MotionFromBehind(np.full((len(scans), 3), np.nan), np.zeros(len(scans)))
    for first, end in stretches:
        before, now = found.inliers[first:end].mean(), inliers[first:end].mean()
        fits_better = now >= max(before + options.standstill_gain, options.scan.restart_inliers)
        if fits_better and _way(poses, first, end) - _way(found.poses, first, end) > options.standstill_lag:
            # The step to the first of them, and the one from the last.
            whole = slice(max(first - 1, 0), end + 1)
            motion.poses[whole], motion.weakest_sigmas[whole] = poses[whole], sigmas[whole]
    return motion if np.isfinite(motion.poses).any() else None


def doubtful_stretches(found: TrackedScans, options: TrackingOptions) -> list[tuple[int, int]]:
    """The stretches (first, end) without `velocity_scans` in a row that fit and tell their place."""
    tells = found.inliers >= options.scan.restart_inliers
    tells &= found.weakest_sigmas <= options.scan.degeneracy.trusted_sigma
    for first, end in mask_runs(tells):
        if end - first < options.velocity_scans:
            tells[first:end] = False
    return mask_runs(~tells)


def _seems_to_stand(poses: Array, first: int, end: int, options: TrackingOptions) -> bool:
    """Whether in a stretch the robot falls far behind where it had come at the highest speed after it.

    A stretch of all scans may be one of a short log, with the highest speed in it.
    """
    run = options.velocity_scans
    starts = range(1 if (first, end) == (0, len(poses)) else end + 1, len(poses) - run + 1)
    fastest = max((_way(poses, at, at + run) / run for at in starts), default=0.0)
    expected, way = fastest * (end - first), _way(poses, first, end)
    return way < options.standstill_share * expected and expected - way > options.standstill_lag


def _way(poses: Array, first: int, end: int) -> float:
    """Distance (m) from the scan before a stretch to its last."""
    return float(np.hypot(*(poses[end - 1] - poses[max(first - 1, 0)])[:2]))
