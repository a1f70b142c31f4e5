"""Step 1 of the loop (paper, V): the pose of every scan, by matching it with the local map.

The local map is one NDT that grows by the scans ahead and loses those behind. It has a frame of its own, so
that corrections of the graph by loops never tear it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.correlative_search import FoundPose, Search
from nscan_cli.matching.likelihood_field import likelihood_field
from nscan_cli.matching.motion_model import Prior, no_prior
from nscan_cli.ndt.energy import inlier_share
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, are_known, relative, wrap
from nscan_cli.slam.frontend.constant_velocity import expected_errors
from nscan_cli.slam.frontend.laser_view import points_in_view
from nscan_cli.slam.frontend.local_map import ROWS, insert_scan, remove_newest
from nscan_cli.slam.frontend.match_restarts import surprise
from nscan_cli.slam.frontend.options import LaserView, TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.point_spacing import points_between
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.track_state import (
    HAS_LEFT,
    KNOWN,
    MAY_WAIT,
    NEXT,
    RESTARTS,
    TrackingProblem,
    TrackState,
)
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_kernels import track_scans


class Tracker:
    """Follows the robot from scan to scan. `odometry` says whether they have any, `laser` what is in view.

    Without odometry, the faces of a wall are not Gaussians of their own: exact ones hold the robot in place
    in corridors that come into view. And all stages converge, since the start of a match is a guess.

    Where the first scans have no odometry, the robot drives ahead with a `speed` (m/s) before them.
    """

    def __init__(
        self,
        options: TrackingOptions,
        odometry: bool = True,
        laser: LaserView | None = None,
        speed: float = 0.0,
    ) -> None:
        self.options, self._speed = options, speed
        self.map = Ndt.empty(options.gaussians, capacity=1 << 14, faces=odometry)
        self.searches = 0
        self._settings = TrackingParameters.of(options, odometry, laser)
        self._track = TrackState.begin(options.velocity_scans + 1, options.scan)
        self._prior = no_prior()
        self._left_out: tuple[Array, Array] | None = None
        """Points (m, 2) and pose (3,) of the last scan if it was lost: it joins the map only if the next one,
        which fits nothing else, fits it."""
        self._is_tried = False
        """Whether it has joined the map, to be tried."""
        self._lost_count = 0
        """Number of the last scans that were lost."""
        self._guess = np.zeros(2)
        """Variances of the place (m²) and the turn (rad²) of the way over the last scans that were lost."""

    @property
    def restarts(self) -> int:
        """How often matches were started from other angles."""
        return int(self._track.counts[RESTARTS])

    def track(self, scans: ScanBatch, may_wait: bool = False) -> TrackedScans:
        """Track the next scans. Of the last ones, which may wait for scans after them, nothing is found."""
        if self._speed and len(scans) > 1:
            speed, self._speed = self._speed, 0.0
            first = self.track(scans.part(0, 1))
            if scans.odometry is not None and not are_known(scans.odometry[0]):
                self._drives(speed, float(scans.times[1] - scans.times[0]))
            return TrackedScans.together([first, self.track(scans.part(1, len(scans)), may_wait)])
        if self._settings.is_alone and self._track.counts[KNOWN] == 0 and len(scans):
            self._insert(self._gap_points(scans.of(0)), np.zeros(3))
        n, k, ends = len(scans), 0, scans.ends
        odometry = np.full((n, 3), np.nan) if scans.odometry is None else scans.odometry
        found = TrackedScans.room(n)
        self._track.counts[NEXT] = 0
        while k < n:
            roomy = self._track.map.with_room(n - k, int(ends[-1] - ends[k]))
            self._track = self._track._replace(map=roomy)
            self.map.reserve(int(ends[k + 1] - ends[k]))
            self._track.map.counts[ROWS] = self.map.rows
            problem = TrackingProblem(
                self._track, self.map.grid, self._settings, scans.points, ends, scans.shares, scans.times,
                odometry, self._prior, found,
            )  # fmt: skip
            begun, k = k, track_scans(problem, k, may_wait, False)
            self.map.rows = int(self._track.map.counts[ROWS])
            if k > begun:
                self._keep(found, begun)
            if k == n or np.isnan(found.inliers[k]):
                continue
            has_left = self._leave_odometry(scans.of(k), odometry[k], found, k)
            if self._track.counts[MAY_WAIT] and not has_left:
                k += 1
                continue
            few = self.options.scan.lost_inliers
            is_searched = not has_left and (found.inliers[k] < few or not are_known(odometry[k]))
            is_clear = is_searched and self._search(scans.of(k), found, k)
            is_lost = self._settings.is_alone and found.inliers[k] < few and not is_clear
            if is_lost and self._left_out is not None and not self._is_tried:
                points, pose = self._left_out
                self._insert(np.concatenate([points, self._gap_points(points)]), pose)
                self._is_tried = True
                continue
            if is_lost:
                found.weakest_sigmas[k] = np.inf
                if self._is_tried:
                    remove_newest(self._track.map, self.map.grid, self._settings)
            track_scans(problem, k, may_wait, True)
            self.map.rows = int(self._track.map.counts[ROWS])
            if is_lost:
                self._leave_out(scans.of(k), found, k)
            else:
                self._keep(found, k)
            k += 1
        return found.part(0, int(self._track.counts[NEXT]))

    def _drives(self, speed: float, period: float) -> None:
        """The robot has come with a speed (m/s) to the first scan, which is a period (s) before the next."""
        poses, times = self._track.poses, self._track.times
        back = period * np.arange(len(poses))[::-1]
        poses[:, 0], times[:] = -speed * back, times[-1] - back
        self._track.counts[KNOWN] = len(poses)

    def _leave_out(self, points: Array, found: TrackedScans, k: int) -> None:
        """Scan k of points (m, 2) is lost."""
        errors = self.options.lost_errors * np.array(expected_errors(self._track))
        self._lost_count += 1
        self._guess += np.minimum(np.diag(found.prior_covariances[k])[1:], errors**2)
        self._left_out, self._is_tried = (points.copy(), found.poses[k].copy()), False

    def _keep(self, found: TrackedScans, k: int) -> None:
        """Scan k fits, alone or with the scan before that was left out."""
        if self._is_tried:
            found.guess_variances[k] = self._guess
        self._left_out, self._is_tried, self._lost_count, self._guess = None, False, 0, np.zeros(2)

    def _insert(self, points: Array, pose: Array) -> None:
        """Let points (m, 2) seen at `pose` (3,) join the map."""
        self.map.reserve(len(points))
        local_map = self._track.map.with_room(1, len(points))
        self._track = self._track._replace(map=local_map)
        local_map.counts[ROWS] = self.map.rows
        insert_scan(local_map, self.map.grid, self._settings, points, pose)
        self.map.rows = int(local_map.counts[ROWS])

    def _gap_points(self, points: Array) -> Array:
        """Points in the gaps between those of a scan (m, 2) that alone makes few Gaussians; else none."""
        options, origin = self.options, np.zeros(3)
        own = Ndt.of_scans(points, np.array([0, len(points)]), origin[None], options.gaussians)
        share = inlier_share(own.grid, own.half, points, origin, options.scan.inlier_bound)
        is_sparse = share <= options.scan.lost_inliers
        return points_between(points, options.gaussians, options.bridged_gap) if is_sparse else points[:0]

    def _search(self, points: Array, found: TrackedScans, k: int) -> bool:
        """Match scan k from where a search among the last ones finds it too; keep the lower objective.

        Without odometry a lost scan that the search finds in one place only is there, whatever its prediction
        says: where the robot turns, the last steps tell little of the next. Returns whether that is so.
        """
        options, is_alone = self.options, self._settings.is_alone
        lost_inliers = options.scan.lost_inliers
        is_lost = is_alone and found.inliers[k] < lost_inliers
        cloud = self._track.map.recent_points(options.scan.window if is_lost else options.lost_search_path)
        if not len(cloud) or not len(points):
            return False
        field = likelihood_field(cloud, options.lost_search)
        search = Search(field, points, self._prior.mean, options.lost_search)
        place = search.best(options.clear_score if is_lost else lost_inliers)
        is_clear = place is not None and is_lost and self._is_clear(search, place)
        if place is None or not (is_clear or place.score > lost_inliers):
            return False
        self.searches += 1
        pose, hessian = place.pose.copy(), np.empty((3, 3))
        prior = Prior(place.pose, self._prior.information) if is_clear else self._prior
        in_view = points_in_view(self._track, self._settings, points, prior.mean)
        value, inliers = match_and_count(self.map.grid, self._settings, in_view, prior, pose, hessian)
        gain = found.values[k] - value
        if is_alone:
            predicted = self._track, options.scan, self._prior
            gain += surprise(*predicted, found.poses[k]) - surprise(*predicted, pose)
        if gain > 0.0 or is_clear:
            found.values[k], found.inliers[k] = value, inliers
            found.poses[k], found.hessians[k] = pose, hessian
        return is_clear

    def _leave_odometry(self, points: Array, odometry: Array, found: TrackedScans, k: int) -> bool:
        """Whether scan k fits far better where odometry excludes it, and nowhere else; it is there then.

        Odometry that stands does so, too, where the robot is carried: it may be farther off then, and costs
        less. People about a robot that stands make it seem to be a little beside its place.
        """
        self._track.counts[HAS_LEFT] = 0
        if not (len(points) and are_known(odometry) and are_known(self._track.odometry)):
            return False
        options, scan = self.options, self.options.scan
        step = relative(odometry, self._track.odometry)
        stands = np.hypot(step[0], step[1]) < scan.min_motion and abs(step[2]) < scan.min_motion
        around = options.carried_search if stands else options.lost_search
        cloud = self._track.map.recent_points(scan.window if stands else options.lost_search_path)
        if not len(cloud):
            return False
        search = Search(likelihood_field(cloud, around), points, self._prior.mean, around)
        place = search.best(scan.lost_inliers if stands else scan.restart_inliers)
        if place is None or self._fits_elsewhere(search, place):
            return False
        self.searches += 1
        pose, hessian = place.pose.copy(), np.empty((3, 3))
        information = np.diag(np.array([around.distance, around.distance, around.turn]) ** -2.0)
        prior = Prior(place.pose, information)
        in_view = points_in_view(self._track, self._settings, points, prior.mean)
        value, inliers = match_and_count(self.map.grid, self._settings, in_view, prior, pose, hessian)
        is_far = np.hypot(*(pose - self._prior.mean)[:2]) > options.lost_search.distance
        most = scan.max_carried_surprise if stands and is_far else scan.max_odometry_surprise
        price = min(_cost(self._prior, pose), most)
        has_more = inliers > found.inliers[k] + scan.inlier_margin
        if not has_more or value - _cost(prior, pose) + price >= found.values[k]:
            return False
        found.values[k], found.inliers[k] = value, inliers
        found.poses[k], found.hessians[k] = pose, hessian
        self._prior.information[:] = information
        self._track.counts[HAS_LEFT] = 1
        return True

    def _is_clear(self, search: Search, place: FoundPose) -> bool:
        """Whether a lost scan fits in no other place nearly as well, and the robot may have come there."""
        options, known = self.options, self._track.poses[-int(self._track.counts[KNOWN]) :, :2]
        longest = np.hypot(*np.diff(known, axis=0).T).max(initial=0.0)
        farthest = options.lost_steps * longest * (1 + self._lost_count)
        if np.hypot(*(place.pose - self._prior.mean)[:2]) > farthest:
            return False
        return not self._fits_elsewhere(search, place)

    def _fits_elsewhere(self, search: Search, place: FoundPose) -> bool:
        """Whether there is another place that is nearly as good."""
        second = self.options.clear_score_ratio * place.score
        return search.best(second, (place.pose, self.options.clear_score_distance)) is not None


def _cost(prior: Prior, pose: Array) -> float:
    """What a prior adds to the objective at a pose (3,): `prior_value`, without compiling it for Python."""
    off = pose - prior.mean
    off[2] = wrap(off[2])
    return float(0.5 * off @ prior.information @ off)
