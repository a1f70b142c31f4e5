"""Step 1 of the loop (paper, V): the pose of every scan, by matching it with the local map.

The local map is one NDT that grows by the scans ahead and loses those behind. It has a frame of its own, so
that corrections of the graph by loops never tear it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.correlative_search import likelihood_field, search
from nscan_cli.matching.motion_model import no_prior
from nscan_cli.ndt.energy import inlier_share
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.degeneracy import NOTHING_TOLD
from nscan_cli.slam.frontend.local_map import ROWS, insert_scan
from nscan_cli.slam.frontend.options import LaserView, TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.point_spacing import points_between
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.track_state import KNOWN, NEXT, RESTARTS, TrackState
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_kernels import settle, track_scans
from nscan_cli.slam.frontend.tracking_problem import TrackingProblem
from nscan_cli.slam.frontend.visible_points import points_in_view


class Tracker:
    """Follows the robot from scan to scan. `odometry` says whether they have any, `laser` what is in view.

    Without odometry, the faces of a wall are not Gaussians of their own: exact ones hold the robot in place
    in corridors that come into view. And all stages converge, since the start of a match is a guess.
    """

    def __init__(
        self, options: TrackingOptions, odometry: bool = True, laser: LaserView | None = None
    ) -> None:
        self.options = options
        self.map = Ndt.empty(options.gaussians, capacity=1 << 14, faces=odometry)
        self.searches = 0
        self._is_alone = not odometry
        """Whether nothing but the scans tells how the robot moves."""
        self._settings = TrackingParameters.of(options, odometry, laser)
        self._track = TrackState.begin(options.velocity_scans + 1, options.scan.degeneracy.initial_sigma)
        self._prior = no_prior()

    @property
    def restarts(self) -> int:
        """How often matches were started from other angles."""
        return int(self._track.counts[RESTARTS])

    def track(self, scans: ScanBatch, may_wait: bool = False) -> TrackedScans:
        """Track the next scans. Of the last ones, which may wait for scans after them, nothing is found."""
        if self._is_alone and self._track.counts[KNOWN] == 0 and len(scans):
            self._bridge_gaps(scans.of(0))
        n, k, ends = len(scans), 0, scans.ends
        odometry = np.full((n, 3), np.nan) if scans.odometry is None else scans.odometry
        roomy = self._track.map.with_room(n, int(ends[-1] - ends[0]))
        self._track = self._track._replace(map=roomy)
        found = TrackedScans.room(n)
        self._track.counts[NEXT] = 0
        while k < n:
            self.map.reserve(int(ends[k + 1] - ends[k]))
            self._track.map.counts[ROWS] = self.map.rows
            problem = TrackingProblem(
                self._track, self.map.grid, self._settings, scans.points, ends, scans.shares, odometry,
                self._prior, found,
            )  # fmt: skip
            k = track_scans(problem, k, may_wait)
            if k < n and np.isfinite(found.inliers[k]):
                self._search(scans.of(k), found, k)
                if self._is_alone and found.inliers[k] < self.options.scan.lost_inliers:
                    found.weakest_sigmas[k] = NOTHING_TOLD
                settle(problem, k)
                k += 1
            self.map.rows = int(self._track.map.counts[ROWS])
        return found.part(0, int(self._track.counts[NEXT]))

    def _bridge_gaps(self, points: Array) -> None:
        """Let points between those of the first scan (m, 2) join the map if alone it makes few Gaussians."""
        options, origin = self.options, np.zeros(3)
        own = Ndt.of_scans(points, np.array([0, len(points)]), origin[None], options.gaussians)
        share = inlier_share(own.grid, own.half, points, origin, options.scan.inlier_bound)
        if share > options.scan.lost_inliers:
            return
        between = points_between(points, options.gaussians, options.bridged_gap)
        self.map.reserve(len(between))
        local_map = self._track.map.with_room(1, len(between))
        self._track = self._track._replace(map=local_map)
        local_map.counts[ROWS] = self.map.rows
        insert_scan(local_map, self.map.grid, self._settings, between, origin)
        self.map.rows = int(local_map.counts[ROWS])

    def _search(self, points: Array, found: TrackedScans, k: int) -> None:
        """Match scan k from where a search among the last scans finds it too; keep the lower objective."""
        options = self.options
        cloud = self._track.map.recent_points(options.lost_search_path)
        if not len(cloud) or not len(points):
            return
        field = likelihood_field(cloud, options.lost_search)
        place = search(field, points, self._prior.mean, options.scan.lost_inliers, options.lost_search)
        if place is None:
            return
        self.searches += 1
        pose, hessian = place.pose.copy(), np.empty((3, 3))
        in_view = points_in_view(self._track, self._settings, points, self._prior.mean)
        value, inliers = match_and_count(self.map.grid, self._settings, in_view, self._prior, pose, hessian)
        if value < found.values[k]:
            found.values[k], found.inliers[k] = value, inliers
            found.poses[k], found.hessians[k] = pose, hessian
