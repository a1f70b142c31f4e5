"""Step 1 with its breaks: where the track breaks, a new segment of it begins.

`break_detection` defines a break. Scans that may be the first after one are doubted for a while: they are
tracked as part of the segment, and also as a segment of their own.

Where a segment begins, the first scan is matched with those after it. The second scan has nothing but the
first to be matched with, the third has two. So the error of that match stays with the first scan, while all
later ones agree with each other, and the whole map is turned by it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.motion_model import Prior
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, are_known, compose, relative
from nscan_cli.slam.frontend.break_detection import (
    contradicts_map,
    count_undoubted,
    is_bridged_by_odometry,
    see_enough,
    sees_the_same,
    was_carried,
)
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.laser_view import laser_view
from nscan_cli.slam.frontend.options import LaserView, TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedBatch, TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.frontend.two_sided_tracker import TwoSidedTracker
from nscan_cli.slam.options import SlamOptions


class SegmentTracker:
    """Tracks the robot segment by segment. Poses of all segments are in one frame, as odometry guesses it.

    `odometry` says whether the scans have any, `laser` is what their laser has in view. Where odometry begins
    later than the log, the robot drives with a `speed` (m/s) before.
    """

    def __init__(
        self,
        options: TrackingOptions,
        breaking: BreakOptions,
        odometry: bool = True,
        laser: LaserView | None = None,
        speed: float = 0.0,
    ) -> None:
        self.options, self.breaking = options, breaking
        self._has_odometry, self._laser = odometry, laser
        self.tracker = self._new_tracker(speed)
        self._restarts = self._searches = 0
        """Restarts and searches of the trackers of earlier segments."""
        self._origin: Array | None = None
        """(3,) pose where the segment begins, unless it is the first."""
        self._path = 0.0
        """Length of the path up to there, m."""
        self._last: TrackedBatch | None = None
        """The last settled scan."""
        self._last_seeing: TrackedBatch | None = None
        """The last settled scan with points enough to compare views."""
        self._usual: deque[float] = deque(maxlen=breaking.usual_scans)
        """Shares of inliers of the last settled scans."""
        self._doubted: list[TrackedBatch] = []
        """Scans that may be the first of a new segment, one by one."""
        self._unmatched: list[ScanBatch] = []
        """The newest scans, which wait until the robot has moved: at most one batch."""
        self._waiting: list[TrackedBatch] | None = []
        """The first scans of a segment, until there are enough to place the first one; None from then on."""

    @property
    def restarts(self) -> int:
        """Matches started from other angles."""
        return self._restarts + self.tracker.restarts

    @property
    def searches(self) -> int:
        """Searches for a lost scan."""
        return self._searches + self.tracker.searches

    def follow(self, scans: ScanBatch, may_wait: bool = True) -> list[TrackedBatch]:
        """Track the next scans; returns those, in order, that are settled by it: not those still doubted.

        The last ones may wait for scans after them.
        """
        settled: list[TrackedBatch] = []
        ahead = self._track(scans, may_wait)
        while ahead:
            known = 0 if self._doubted else count_undoubted(ahead, self._last_seeing, self.breaking)
            if known == len(ahead):
                return settled + self._settle(ahead)
            if known:
                settled += self._settle(ahead.part(0, known))
                ahead = ahead.part(known, len(ahead))
                continue
            tracker = self.tracker
            settled += self._doubt(ahead.one(0))
            ahead = ahead.part(1, len(ahead))
            if self.tracker is not tracker and ahead:
                # A new segment has begun: what was tracked ahead is tracked again, as a part of it.
                ahead = self._track(ahead.scans, may_wait)
        return settled

    def finish(self) -> list[TrackedBatch]:
        """The last scans, which nothing settles any more. Nothing can be tracked after them."""
        settled: list[TrackedBatch] = []
        if self._unmatched:
            settled += self.follow(self._unmatched.pop(), may_wait=False)
        settled += self._settle_doubted() + self._place_first()
        self._restarts, self._searches = self.restarts, self.searches
        # The local map is large, and of no use any more.
        self.tracker = self._new_tracker()
        return settled

    def _new_tracker(self, speed: float = 0.0) -> Tracker | TwoSidedTracker:
        if self._has_odometry:
            return Tracker(self.options, laser=self._laser, speed=speed)
        return TwoSidedTracker(self.options, self._laser)

    def _track(self, scans: ScanBatch, may_wait: bool) -> TrackedBatch:
        """Track scans, and those after them or before them that waited; the last ones may wait now."""
        unmatched = self._unmatched
        together = sorted([scans, *unmatched], key=lambda batch: batch.first)
        scans = ScanBatch.together(together) if unmatched else scans
        found = self.tracker.track(scans, may_wait)
        n = len(found.values)
        self._unmatched = [scans.part(n, len(scans))] if n < len(scans) else []
        if self._origin is not None:
            found = self._from_origin(found, self._origin)
        return TrackedBatch(scans.part(0, n), found)

    def _from_origin(self, found: TrackedScans, origin: Array) -> TrackedScans:
        """What was found in a later segment, in the frame of the first."""
        c, s = np.cos(origin[2]), np.sin(origin[2])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return found._replace(
            poses=compose(origin, found.poses),
            hessians=turn @ found.hessians @ turn.T,
            prior_covariances=turn @ found.prior_covariances @ turn.T,
            paths=self._path + found.paths,
        )

    def _doubt(self, scan: TrackedBatch) -> list[TrackedBatch]:
        """Add to the doubted scans; returns what is settled, if it puts an end to the doubts."""
        is_first, may_wait = not self._doubted, len(self._doubted) < self.breaking.max_doubted
        self._doubted.append(scan)
        if is_first:
            return []
        assert self._last_seeing is not None
        if sees_the_same(scan, self._last_seeing, self.breaking):
            return self._settle_doubted()
        if may_wait:
            return []
        waits = (
            self._seems_carried()
            and not self._has_driven()
            and len(self._doubted) < self.breaking.max_standing
        )
        if waits and len(self._doubted) > self.breaking.max_doubted + 1:
            return []
        return self._break_track_if_sure() or ([] if waits else self._settle_doubted())

    def _seems_carried(self) -> bool:
        """Whether the first of the doubted scans sees other things, though odometry stood."""
        return self._last is not None and was_carried(self._doubted[0], self._last, self.breaking)

    def _has_driven(self) -> bool:
        """Whether the robot has driven on since, by odometry."""
        first, newest = self._doubted[0].scans.odometry, self._doubted[-1].scans.odometry
        if first is None or newest is None:
            return False
        return bool(np.hypot(*(newest[0] - first[0])[:2]) >= self.breaking.driven)

    def _settle_doubted(self) -> list[TrackedBatch]:
        scans, self._doubted = self._doubted, []
        return [settled for scan in scans for settled in self._settle(scan)]

    def _settle(self, batch: TrackedBatch) -> list[TrackedBatch]:
        """Settle scans; those that a segment begins with wait until the first can be placed."""
        self._last = batch.one(-1)
        self._usual.extend(batch.tracked.inliers.tolist())
        seeing = np.flatnonzero(see_enough(batch, self.breaking))
        if len(seeing):
            self._last_seeing = batch.one(int(seeing[-1]))
        if self._waiting is None:
            return [batch]
        begun = (self._waiting or [batch])[0].tracked.paths[0]
        far = np.flatnonzero(batch.tracked.paths - begun > self.options.first_scan_path)
        if not len(far):
            self._waiting.append(batch)
            is_full = sum(map(len, self._waiting)) >= self.options.first_scan_max_count
            return self._place_first() if is_full else []
        end = int(far[0]) + 1
        self._waiting.append(batch.part(0, end))
        later = [batch.part(end, len(batch))] if end < len(batch) else []
        return self._place_first() + later

    def _place_first(self) -> list[TrackedBatch]:
        """The waiting scans, the first of them placed by the others."""
        waiting, self._waiting = self._waiting, None
        if not waiting:
            return []
        first, found = waiting[0], TrackedScans.together(batch.tracked for batch in waiting)
        poses = first.tracked.poses.copy()
        poses[0] = pose_of_first_scan(
            ScanBatch.together([batch.scans for batch in waiting]), found, self.options
        )
        return [replace(first, tracked=first.tracked._replace(poses=poses)), *waiting[1:]]

    def _break_track_if_sure(self) -> list[TrackedBatch]:
        """Track the doubted scans anew, as a segment of their own; empty if they do not fit together.

        The track is broken, and the way there unknown, unless odometry bridges it.
        """
        usual = float(np.median(self._usual))
        # Without odometry nothing but the scans leads a tracker on that is lost.
        is_lost = not self._has_odometry and usual < self.options.scan.lost_inliers
        last, first = self._last, self._doubted[0]
        assert last is not None
        is_carried = self._seems_carried() and self._has_driven()
        if not (is_lost or is_carried or contradicts_map(first, usual, self.breaking)):
            return []
        kept = self.tracker, self._origin, self._path
        guess = origin = last.tracked.poses[0]
        if first.scans.odometry is not None and last.scans.odometry is not None:
            step = relative(first.scans.odometry[0], last.scans.odometry[0])
            guess = compose(origin, step) if are_known(step) else origin
        self.tracker, self._origin = self._new_tracker(), guess
        is_bridged = is_bridged_by_odometry(first, self._last_seeing, self.breaking)
        self._path = float(last.tracked.paths[0])
        self._path += float(np.hypot(*(guess - origin)[:2])) if is_bridged else self.breaking.path
        unmatched, self._unmatched = self._unmatched, []
        segment = self._track(ScanBatch.together([scan.scans for scan in self._doubted]), may_wait=False)
        self._unmatched = unmatched
        inliers, in_map = segment.tracked.inliers[1:], [scan.tracked.inliers[0] for scan in self._doubted[1:]]
        fits_together = np.median(inliers) >= self.breaking.poor_inliers
        if not (fits_together or (is_carried and np.mean(inliers) > np.mean(in_map))):
            self.tracker, self._origin, self._path = kept
            return []
        self._restarts += kept[0].restarts
        self._searches += kept[0].searches
        segment.tracked.inliers[0] = 0.0
        distance, turn = self.breaking.distance_sigma, self.breaking.turn_sigma
        segment.tracked.prior_covariances[0] = (
            first.tracked.prior_covariances[0] if is_bridged else np.diag([distance, distance, turn]) ** 2
        )
        before, self._waiting, self._doubted = self._place_first(), [], []
        return before + self._settle(replace(segment, starts_segment=True, after_break=not is_bridged))


def tracker_of(log: LaserLog, options: SlamOptions) -> SegmentTracker:
    """The tracker for a log."""
    laser, speed = laser_view(log, options.tracking), first_speed(log, options.tracking.velocity_scans)
    return SegmentTracker(options.tracking, options.breaks, log.odometry is not None, laser, speed)


def first_speed(log: LaserLog, scans: int) -> float:
    """The speed ahead (m/s) with which odometry begins, by its first steps between scans; 0 if the first scan
    has odometry, or the robot stands."""
    if log.odometry is None or are_known(log.odometry[0]):
        return 0.0
    rows = np.flatnonzero(are_known(log.odometry))[: scans + 1]
    lasts = float(log.times[rows[-1]] - log.times[rows[0]]) if len(rows) else 0.0
    return float(relative(log.odometry[rows[-1]], log.odometry[rows[0]])[0]) / lasts if lasts > 0.0 else 0.0


def pose_of_first_scan(scans: ScanBatch, found: TrackedScans, options: TrackingOptions) -> Array:
    """The pose (3,) of the first of some scans, matched with the others; the step to the next is the prior.

    It stays where it was found if too few of its points are inliers.
    """
    first: Array = found.poses[0]
    joined = np.flatnonzero(found.in_map[1:]) + 1
    if not len(joined):
        return first
    points, ends = scans.chosen(joined)
    ndt = Ndt.of_scans(points, ends, found.poses[joined], options.gaussians)
    pose, hessian = first.copy(), np.empty((3, 3))
    step: Array = np.linalg.inv(found.prior_covariances[1]).astype(np.float64)
    prior = Prior(first, step)
    _, inliers = match_and_count(ndt.grid, TrackingParameters.of(options), scans.of(0), prior, pose, hessian)
    return pose if inliers >= options.scan.restart_inliers else first
