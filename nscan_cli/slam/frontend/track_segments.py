"""Step 1 of the loop with its breaks: where a scan does not go on from those before, a new piece begins.

A robot that is lifted and put down elsewhere sees what no match with the last metres explains. The tracker
takes the best match all the same. That it is none shows in what two scans see from nearly the same place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative, transform
from nscan_cli.slam.frontend.first_scan import PATH, SCANS, place_first
from nscan_cli.slam.frontend.options import BreakOptions, TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.frontend.view_similarity import LEAST_BEARINGS, view_similarity
from nscan_cli.slam.frontend.visible_points import sight
from nscan_cli.slam.options import SlamOptions


@dataclass(frozen=True)
class TrackedSegments:
    """Scans that were tracked, as many as were sensed."""

    sensed: ScanBatch
    found: TrackedScans
    begins: bool = False
    """Whether a piece begins with the first of the scans,"""
    breaks: bool = False
    """and nothing is known of the way there: the track has broken."""

    def __len__(self) -> int:
        return len(self.sensed)

    @property
    def see_enough(self) -> NDArray[np.bool_]:
        """(n,) which of them see enough to be compared with others."""
        enough: NDArray[np.bool_] = np.diff(self.sensed.ends) >= LEAST_BEARINGS
        return enough

    def part(self, first: int, end: int) -> TrackedSegments:
        """The scans from the `first` on, before the `end`."""
        sensed, found = self.sensed.part(first, end), self.found.part(first, end)
        return TrackedSegments(sensed, found, self.begins and first == 0, self.breaks and first == 0)

    def one(self, k: int) -> TrackedSegments:
        """One of the scans; counted from the end if k is negative."""
        k %= len(self)
        return self.part(k, k + 1)


class SegmentTracker:
    """Follows the robot piece by piece. The poses of all pieces are in one frame, as odometry guesses it.

    `odometry` tells whether the scans have any.
    """

    def __init__(
        self,
        options: TrackingOptions,
        breaking: BreakOptions,
        odometry: bool = True,
        range_limit: float = np.inf,
    ) -> None:
        self.options, self.breaking, self._has_odometry = options, breaking, odometry
        self._range_limit = range_limit
        self._tracker = Tracker(options, odometry, range_limit)
        self._restarts = self._searches = 0
        self._origin: Array | None = None
        """Where the piece begins, unless it is the first."""
        self._path = 0.0
        self._seen: TrackedSegments | None = None
        """The last settled scan that saw enough."""
        self._last: TrackedSegments | None = None
        self._doubted: list[TrackedSegments] = []
        """One by one."""
        self._young: list[TrackedSegments] | None = []
        """The scans that a piece has begun with, until there are enough to place the first."""

    @property
    def restarts(self) -> int:
        """Matches started from other angles."""
        return self._restarts + self._tracker.restarts

    @property
    def searches(self) -> int:
        """Searches for a scan among the last ones."""
        return self._searches + self._tracker.searches

    def follow(self, scans: ScanBatch) -> list[TrackedSegments]:
        """Track the next scans. Returns those, in order, that are settled by it: not those still doubted."""
        settled: list[TrackedSegments] = []
        ahead = self._track(scans)
        while ahead:
            known = 0 if self._doubted else self._known(ahead)
            if known == len(ahead):
                return settled + self._settle(ahead)
            if known:
                settled += self._settle(ahead.part(0, known))
                ahead = ahead.part(known, len(ahead))
                continue
            tracker = self._tracker
            settled += self._doubt(ahead.one(0))
            ahead = ahead.part(1, len(ahead))
            if self._tracker is not tracker and ahead:
                # A new piece has begun, and what was tracked ahead goes on from it.
                ahead = self._track(ahead.sensed)
        return settled

    def _known(self, scans: TrackedSegments) -> int:
        """How many of the scans, from the first on, go on from those before."""
        poor = scans.found.inliers < self.breaking.poor_inliers
        if not poor.any():
            return len(scans)
        enough = scans.see_enough
        for k in np.flatnonzero(poor & enough).tolist():
            before = np.flatnonzero(enough[:k])
            seen = scans.one(int(before[-1])) if len(before) else self._seen
            if seen is not None and not self._goes_on(scans.one(k), seen):
                return int(k)
        return len(scans)

    def _doubt(self, scan: TrackedSegments) -> list[TrackedSegments]:
        """Doubt a scan, or find that it puts an end to doubts; returns what is settled by it."""
        begins, patient = not self._doubted, len(self._doubted) < self.breaking.max_doubted
        self._doubted.append(scan)
        if begins:
            return []
        assert self._seen is not None
        if self._goes_on(scan, self._seen):
            return self._believe()
        return [] if patient else self._break() or self._believe()

    def finish(self) -> list[TrackedSegments]:
        """The last scans, which nothing settles any more. Nothing can be tracked after them."""
        settled = self._believe() + self._grow_up()
        self._restarts, self._searches = self.restarts, self.searches
        # The map of the last metres is large, and of no use any more.
        self._tracker = Tracker(self.options, self._has_odometry, self._range_limit)
        return settled

    def _believe(self) -> list[TrackedSegments]:
        """The scans that were doubted, as they were tracked."""
        scans, self._doubted = self._doubted, []
        return [settled for scan in scans for settled in self._settle(scan)]

    def _track(self, scans: ScanBatch) -> TrackedSegments:
        found = self._tracker.track(scans)
        return TrackedSegments(
            scans, found if self._origin is None else self._of_the_piece(found, self._origin)
        )

    def _of_the_piece(self, found: TrackedScans, origin: Array) -> TrackedScans:
        """What was found in a later piece, in the frame of the first."""
        c, s = np.cos(origin[2]), np.sin(origin[2])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return found._replace(
            poses=compose(origin, found.poses),
            hessians=turn @ found.hessians @ turn.T,
            expected=turn @ found.expected @ turn.T,
            paths=self._path + found.paths,
        )

    def _settle(self, scans: TrackedSegments) -> list[TrackedSegments]:
        self._last = scans.one(-1)
        seen = np.flatnonzero(scans.see_enough)
        if len(seen):
            self._seen = scans.one(int(seen[-1]))
        if self._young is None:
            return [scans]
        begun = (self._young or [scans])[0].found.paths[0]
        far = np.flatnonzero(scans.found.paths - begun > PATH)
        if not len(far):
            self._young.append(scans)
            return self._grow_up() if sum(map(len, self._young)) >= SCANS else []
        enough_by = int(far[0]) + 1
        self._young.append(scans.part(0, enough_by))
        later = [scans.part(enough_by, len(scans))] if enough_by < len(scans) else []
        return self._grow_up() + later

    def _grow_up(self) -> list[TrackedSegments]:
        """The scans that the piece has begun with, the first where the others have it."""
        young, self._young = self._young, None
        if not young:
            return []
        first, found = young[0], TrackedScans.together(scans.found for scans in young)
        poses = first.found.poses.copy()
        poses[0] = place_first(ScanBatch.together([scans.sensed for scans in young]), found, self.options)
        return [replace(first, found=first.found._replace(poses=poses)), *young[1:]]

    def _has_come_far(self, scan: TrackedSegments) -> bool:
        """Whether a scan may well see other things: the laser was blind, or scans are missing."""
        before = self._seen
        if before is None or before.sensed.odometry is None or scan.sensed.odometry is None:
            return False
        step = relative(scan.sensed.odometry[0], before.sensed.odometry[0])
        return bool(
            np.hypot(step[0], step[1]) > self.breaking.bridged_distance
            or abs(step[2]) > self.breaking.bridged_turn
        )

    def _goes_on(self, scan: TrackedSegments, seen: TrackedSegments) -> bool:
        """Whether a scan sees what another one saw that was settled."""
        before = relative(seen.found.poses[0], scan.found.poses[0])
        apart, per_metre = self.breaking.view.tolerance, self.breaking.view.tolerance_per_metre
        share = view_similarity(scan.sensed.of(0), transform(before, seen.sensed.of(0)), apart, per_metre)
        return share is not None and share >= self.breaking.min_similarity

    def _break(self) -> list[TrackedSegments]:
        """Track the doubted scans anew, as a piece of their own; empty if they do not hang together.

        Of the way there odometry has the only word, if it says that the robot has come far; else nothing
        is known.
        """
        kept = self._tracker, self._origin, self._path
        last, first = self._last, self._doubted[0]
        assert last is not None
        guess = origin = last.found.poses[0]
        if first.sensed.odometry is not None and last.sensed.odometry is not None:
            guess = compose(origin, relative(first.sensed.odometry[0], last.sensed.odometry[0]))
        self._tracker, self._origin = Tracker(self.options, self._has_odometry, self._range_limit), guess
        is_known = self._has_come_far(first)
        self._path = float(last.found.paths[0])
        self._path += float(np.hypot(*(guess - origin)[:2])) if is_known else self.breaking.path
        piece = self._track(ScanBatch.together([scan.sensed for scan in self._doubted]))
        if np.median(piece.found.inliers[1:]) < self.breaking.poor_inliers:
            self._tracker, self._origin, self._path = kept
            return []
        self._restarts += kept[0].restarts
        self._searches += kept[0].searches
        piece.found.inliers[0] = 0.0
        if not is_known:
            distance, turn = self.breaking.distance_sigma, self.breaking.turn_sigma
            piece.found.expected[0] = np.diag([distance, distance, turn]) ** 2
        else:
            piece.found.expected[0] = first.found.expected[0]
        before, self._young, self._doubted = self._grow_up(), [], []
        return before + self._settle(replace(piece, begins=True, breaks=not is_known))


def tracker_of(log: LaserLog, options: SlamOptions) -> SegmentTracker:
    """The tracker for a log."""
    seen, cell = log.ranges[log.ranges < options.tracking.max_range], options.tracking.gaussians.cell
    return SegmentTracker(options.tracking, options.breaks, log.odometry is not None, sight(seen, cell))
