"""Step 2 of the loop (paper, V): which scans become keyframes, and which scans make their Gaussians.

Scans at which tracking may have slipped should not become keyframes. Along a hedge or a fence a scan fits at
several places. One that slips to another is off the odometry, and has fewer inliers than the scans before;
some scans later the track slips back. Neither sign alone is enough: wheels spin, and new things come into
view.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.poses import Array, Indices, Mask
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedScan, TrackedScans
from nscan_cli.slam.keyframes.keyframe import Keyframe, KeyframePoints, count_cells
from nscan_cli.slam.keyframes.options import KeyframeOptions


class SlipDetector:
    """Looks for slips, scan after scan."""

    def __init__(self, options: KeyframeOptions) -> None:
        self._sigmas, self._drop = options.slip_sigmas, options.slip_inlier_drop
        self._usual, self._slipped = 0.0, False

    def find(self, found: TrackedScans) -> Mask:
        """(n,) which of the next scans may have slipped: all until the share of inliers is as before."""
        slipped = np.zeros(len(found.odometry_sigmas), dtype=np.bool_)
        if not self._slipped and not (found.odometry_sigmas > self._sigmas).any():
            self._usual = float(found.inliers[-1])
            return slipped
        for k, (off, inliers) in enumerate(
            zip(found.odometry_sigmas.tolist(), found.inliers.tolist(), strict=True)
        ):
            self._slipped = inliers < self._usual - self._drop and (self._slipped or off > self._sigmas)
            if not self._slipped:
                self._usual = inliers
            slipped[k] = self._slipped
        return slipped


class Keyframes:
    """The keyframes in order of time, and the scans since the last; `median_range` (m) of the log's beams."""

    def __init__(
        self, options: KeyframeOptions, gaussians: GaussianOptions, median_range: float = 0.0
    ) -> None:
        self.options, self.gaussians = options, gaussians
        self.distance = max(options.distance, options.distance_per_range * median_range)
        self.list: list[Keyframe] = []
        self._slips = SlipDetector(options)
        self._since: list[KeyframePoints] = []
        self._prior_covariance = np.zeros((3, 3))
        self._guess_variances = np.zeros(2)

    def without_any(self) -> Keyframes:
        """No keyframes yet, with the same options and distance."""
        empty = Keyframes(self.options, self.gaussians)
        empty.distance = self.distance
        return empty

    def __len__(self) -> int:
        return len(self.list)

    def select(self, scans: ScanBatch, found: TrackedScans, begins: bool = False) -> None:
        """Take in tracked scans: some become keyframes, among them the first if a track segment begins."""
        begins |= not self.list
        before = found.poses[0] if begins else self.list[-1].tracked.pose
        bounds = self.distance, self.options.turn, self.options.slip_factor
        lost = np.isinf(found.weakest_sigmas)
        new = _new_keyframes(found.poses, self._slips.find(found), lost, int(begins), before, bounds).tolist()
        first = 0
        for k in [0, *new] if begins else new:
            self.attach(scans, found, first, k)
            self.add(scans.first + k, scans.of(k), found.scan(k))
            first = k + 1
        self.attach(scans, found, first, len(scans))

    def attach(self, scans: ScanBatch, found: TrackedScans, first: int, end: int) -> None:
        """Add scans from the `first` on, before the `end`, to the Gaussians of the keyframes beside them."""
        covariances = [self._prior_covariance[None], found.prior_covariances[first:end]]
        self._prior_covariance = np.add.reduce(np.concatenate(covariances))
        self._guess_variances = self._guess_variances + found.guess_variances[first:end].sum(axis=0)
        inserted = first + np.flatnonzero(found.in_map[first:end])
        if len(inserted):
            points, ends = scans.chosen(inserted)
            self._since.append(KeyframePoints(points, np.diff(ends), found.poses[inserted]))

    def add(self, row: int, points: Array, tracked: TrackedScan) -> Keyframe:
        """Make a scan a keyframe; no further scans are attached to the one before."""
        # Copied: a view would keep the points of all scans that were tracked together.
        points, since = points.copy(), self._since
        self.end_segment()
        cells = count_cells(points, 0.5 * self.gaussians.cell)
        own = KeyframePoints(points, np.array([len(points)]), tracked.pose[None])
        covariance = self._prior_covariance + tracked.prior_covariance
        guess = self._guess_variances + tracked.guess_variances
        keyframe = Keyframe(row, tracked, covariance, points, cells, self.gaussians, [own, *since], guess)
        self._prior_covariance, self._guess_variances = np.zeros((3, 3)), np.zeros(2)
        self.list.append(keyframe)
        return keyframe

    def end_segment(self) -> None:
        """End a track segment: the scans since the last keyframe belong to it alone."""
        if self.list:
            self.list[-1].around.extend(self._since)
        self._since = []


@kernel
def _new_keyframes(
    poses: Array, slipped: Mask, lost: Mask, first: int, before: Array, bounds: tuple[float, float, float]
) -> Indices:
    """Which of the poses (n, 3), from the `first` on, become keyframes.

    Those that are `lost` do not. Each other one is the first beyond a distance (m) or turn (rad) of the one
    before; the first of all, of `before`. These are the first two bounds. Where a scan may have slipped, both
    are multiplied by the third.
    """
    distance, turn, slip_factor = bounds
    new, count, last = np.empty(len(poses), dtype=np.int64), 0, before
    for k in range(first, len(poses)):
        if lost[k]:
            continue
        away = np.hypot(poses[k, 0] - last[0], poses[k, 1] - last[1])
        factor = slip_factor if slipped[k] else 1.0
        if not (away <= factor * distance and abs(wrapped(poses[k, 2] - last[2])) <= factor * turn):
            new[count], last = k, poses[k]
            count += 1
    return new[:count].copy()
