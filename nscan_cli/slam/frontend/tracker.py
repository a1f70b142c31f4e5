"""Step 1 of the loop (paper, V): the pose of every scan by matching it with the map of the last metres.

The map is one NDT that grows by the scans ahead and loses those behind, in a frame of its own: what
loops later correct in the graph never tears it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.correlative_search import likelihood_field, search
from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_kernels import (
    LEAST_SCORE,
    RESTARTS,
    ROWS,
    Track,
    follow,
    take,
    told_points,
)
from nscan_cli.slam.frontend.tracking_parameters import TrackingParameters

RECENT = 5.0
"""A lost scan is searched among those of the last stretch of path, m."""


class Tracker:
    """Follows the robot from scan to scan. `odometry` tells whether there is any.

    Without it each face of a wall on the map is no Gaussian of its own: exact ones hold the robot where it is
    in corridors that come into view, as nothing else does. And the start of a match is a guess: its wide
    stages are done to their end.
    """

    def __init__(self, options: TrackingOptions, odometry: bool = True, range_limit: float = np.inf) -> None:
        self.options = options
        gaussians = options.gaussians
        self.map = Ndt.empty(
            gaussians.cell, gaussians.minimum, gaussians.floor, capacity=1 << 14, faces=odometry
        )
        self.searches = 0
        self._settings = TrackingParameters.of(options, odometry, range_limit)
        self._track = Track.begin(options.velocity_scans + 1)
        self._prior = Prior(np.zeros(3), np.zeros((3, 3)))

    @property
    def restarts(self) -> int:
        """How often scans were matched from more angles."""
        return int(self._track.counts[RESTARTS])

    def track(self, scans: ScanBatch) -> TrackedScans:
        """Where the next scans are found."""
        n, k = len(scans), 0
        points, ends = scans.points, scans.ends
        odometry = np.full((n, 3), np.nan) if scans.odometry is None else scans.odometry
        self._track = self._track.with_room(n, int(ends[-1] - ends[0]))
        found = TrackedScans.room(n)
        while k < n:
            self.map.reserve(int(ends[k + 1] - ends[k]))
            self._track.counts[ROWS] = self.map.rows
            track, grid, settings, prior = self._track, self.map.grid, self._settings, self._prior
            k = follow(track, grid, settings, points, ends, odometry, k, prior, found)
            if k < n and np.isfinite(found.inliers[k]):
                self._search(scans.of(k), found, k)
                take(track, grid, settings, scans.of(k), odometry[k], prior, found, k)
                k += 1
            self.map.rows = int(self._track.counts[ROWS])
        return found

    def _search(self, points: Array, found: TrackedScans, k: int) -> None:
        """Match scan k from where a search among the last scans leads, too; the lower objective counts."""
        cloud = self._track.recent(RECENT)
        if not len(cloud) or not len(points):
            return
        field = likelihood_field(cloud, self.options.lost_search)
        place = search(field, points, self._prior.mean, LEAST_SCORE, self.options.lost_search)
        if place is None:
            return
        self.searches += 1
        pose, hessian = place.pose.copy(), np.empty((3, 3))
        told = told_points(self._track, self._settings, points, self._prior.mean)
        value, inliers = match_and_count(self.map.grid, self._settings, told, self._prior, pose, hessian)
        if value < found.values[k]:
            found.values[k], found.inliers[k] = value, inliers
            found.poses[k], found.hessians[k] = pose, hessian
