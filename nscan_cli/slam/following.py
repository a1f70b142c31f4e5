"""Step 1 of the loop with its breaks: where a scan does not go on from those before, a new piece begins.

A robot that is lifted and put down elsewhere sees what no match with the last metres explains. The tracker
takes the best match all the same. That it is none shows in what two scans see from nearly the same place.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array, compose, relative, transform
from nscan_cli.slam.first_scan import PATH, place_first
from nscan_cli.slam.options import BreakOptions, TrackingOptions
from nscan_cli.slam.tracking import Tracked, Tracker

BEARINGS = 180
"""Into so many parts the view is divided."""
LEAST_BEARINGS = 10
"""Of these two scans must share so many to be compared."""


class Sensed(NamedTuple):
    """A scan of the log, and what the odometry says."""

    row: int
    points: Array
    """(m, 2) in the robot's frame."""
    odometry: Array | None
    """(3,) pose of the robot; of all scans or of none."""


@dataclass(frozen=True)
class Followed:
    """A scan that was tracked; see Sensed."""

    row: int
    points: Array
    odometry: Array | None
    tracked: Tracked
    begins: bool
    """Whether a piece begins with this scan,"""
    breaks: bool
    """and nothing is known of the way there: the track has broken."""


class Follower:
    """Follows the robot piece by piece. The poses of all pieces are in one frame, as odometry guesses it.

    `odometry` tells whether the scans have any.
    """

    def __init__(self, options: TrackingOptions, breaking: BreakOptions, odometry: bool = True) -> None:
        self.options, self.breaking, self._has_odometry = options, breaking, odometry
        self._tracker = Tracker(options, self._has_odometry)
        self._restarts = self._searches = 0
        self._origin: Array | None = None
        """Where the piece begins, unless it is the first."""
        self._path = 0.0
        self._seen: Followed | None = None
        """The last settled scan that saw enough."""
        self._last: Followed | None = None
        self._doubted: list[Followed] = []
        self._young: list[Followed] | None = []
        """The scans that a piece has begun with, until there are enough to place the first."""

    @property
    def restarts(self) -> int:
        """Matches started from other angles."""
        return self._restarts + self._tracker.restarts

    @property
    def searches(self) -> int:
        """Searches for a scan among the last ones."""
        return self._searches + self._tracker.searches

    def follow(self, scans: Sequence[Sensed]) -> list[Followed]:
        """Track the next scans. Returns those, in order, that are settled by it: not those still doubted."""
        settled, ahead = [], deque(self._track(scans))
        while ahead:
            tracker = self._tracker
            settled += self._take(ahead.popleft())
            if self._tracker is not tracker:
                # A new piece has begun, and what was tracked ahead goes on from it.
                ahead = deque(self._track(ahead))
        return settled

    def _take(self, scan: Followed) -> list[Followed]:
        """Settle a scan, doubt it, or find that it puts an end to doubts; returns what is settled by it."""
        if not self._doubted:
            if not self._is_doubted(scan):
                return self._settle([scan])
            self._doubted.append(scan)
            return []
        self._doubted.append(scan)
        if self._goes_on(scan):
            return self._believe()
        if len(self._doubted) <= self.breaking.patience:
            return []
        return self._break() or self._believe()

    def finish(self) -> list[Followed]:
        """The last scans, which nothing settles any more. Nothing can be tracked after them."""
        settled = self._believe() + self._grow_up()
        self._restarts, self._searches = self.restarts, self.searches
        # The map of the last metres is large, and of no use any more.
        self._tracker = Tracker(self.options, self._has_odometry)
        return settled

    def _believe(self) -> list[Followed]:
        """The scans that were doubted, as they were tracked."""
        scans, self._doubted = self._doubted, []
        return self._settle(scans)

    def _track(self, scans: Sequence[Sensed | Followed]) -> list[Followed]:
        odometry = [scan.odometry for scan in scans if scan.odometry is not None]
        found = self._tracker.track([scan.points for scan in scans], np.array(odometry) if odometry else None)
        if self._origin is not None:
            found = [self._of_the_piece(tracked) for tracked in found]
        return [
            Followed(scan.row, scan.points, scan.odometry, tracked, False, False)
            for scan, tracked in zip(scans, found, strict=True)
        ]

    def _of_the_piece(self, tracked: Tracked) -> Tracked:
        """What was found in a later piece, in the frame of the first."""
        assert self._origin is not None
        c, s = np.cos(self._origin[2]), np.sin(self._origin[2])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return replace(
            tracked,
            pose=compose(self._origin, tracked.pose),
            hessian=turn @ tracked.hessian @ turn.T,
            expected=turn @ tracked.expected @ turn.T,
            path=self._path + tracked.path,
        )

    def _settle(self, scans: list[Followed]) -> list[Followed]:
        for scan in scans:
            self._last = scan
            if len(scan.points) >= LEAST_BEARINGS:
                self._seen = scan
        if self._young is None:
            return scans
        self._young += scans
        is_enough = scans and scans[-1].tracked.path - self._young[0].tracked.path > PATH
        return self._grow_up() if is_enough else []

    def _grow_up(self) -> list[Followed]:
        """The scans that the piece has begun with, the first where the others have it."""
        young, self._young = self._young, None
        if not young:
            return []
        first, *others = young
        scans, after = [scan.points for scan in others], [scan.tracked for scan in others]
        placed = place_first(first.tracked, first.points, scans, after, self.options)
        return [replace(first, tracked=placed), *others]

    def _is_doubted(self, scan: Followed) -> bool:
        """Whether a scan that sees enough was matched poorly, and sees other things than the one before."""
        poor = len(scan.points) >= LEAST_BEARINGS and scan.tracked.inliers < self.breaking.inlier_share
        return poor and self._seen is not None and not self._goes_on(scan)

    def _has_come_far(self, scan: Followed) -> bool:
        """Whether a scan may well see other things: the laser was blind, or scans are missing."""
        before = self._seen
        if before is None or before.odometry is None or scan.odometry is None:
            return False
        step = relative(scan.odometry, before.odometry)
        return bool(np.hypot(step[0], step[1]) > self.breaking.far or abs(step[2]) > self.breaking.far_turned)

    def _goes_on(self, scan: Followed) -> bool:
        """Whether a scan sees what the last one saw that was settled."""
        assert self._seen is not None
        before = relative(self._seen.tracked.pose, scan.tracked.pose)
        share = alike(scan.points, transform(before, self._seen.points), self.breaking)
        return share is not None and share >= self.breaking.alike

    def _break(self) -> list[Followed]:
        """Track the doubted scans anew, as a piece of their own; empty if they do not hang together.

        Of the way there odometry has the only word, if it says that the robot has come far; else nothing
        is known.
        """
        kept = self._tracker, self._origin, self._path
        doubted, last = self._doubted, self._last
        assert last is not None
        first, guess = doubted[0], last.tracked.pose
        if first.odometry is not None and last.odometry is not None:
            guess = compose(guess, relative(first.odometry, last.odometry))
        self._tracker, self._origin = Tracker(self.options, self._has_odometry), guess
        is_known = self._has_come_far(first)
        self._path = last.tracked.path
        self._path += float(np.hypot(*(guess - last.tracked.pose)[:2])) if is_known else self.breaking.path
        piece = self._track(doubted)
        if np.median([scan.tracked.inliers for scan in piece[1:]]) < self.breaking.inlier_share:
            self._tracker, self._origin, self._path = kept
            return []
        self._restarts += kept[0].restarts
        self._searches += kept[0].searches
        distance, turn = self.breaking.distance, self.breaking.turn
        wide = np.diag([distance, distance, turn]) ** 2
        expected = first.tracked.expected if is_known else wide
        begins = replace(piece[0].tracked, expected=expected, inliers=0.0)
        piece[0] = replace(piece[0], tracked=begins, begins=True, breaks=not is_known)
        before, self._young, self._doubted = self._grow_up(), [], []
        return before + self._settle(piece)


def alike(points: Array, others: Array, breaking: BreakOptions) -> float | None:
    """Share of bearings in which two scans meet the nearest thing at the same range; None: too few to tell.

    Points (m, 2) and (n, 2) in the frame of one of the robot's poses; only bearings in which both meet
    something count.
    """
    one, other = _ranges(points), _ranges(others)
    both = np.isfinite(one) & np.isfinite(other)
    if np.count_nonzero(both) < LEAST_BEARINGS:
        return None
    near = np.minimum(one[both], other[both])
    apart = np.abs(one[both] - other[both])
    return float(np.mean(apart < breaking.apart + breaking.apart_per_metre * near))


def _ranges(points: Array) -> Array:
    """(BEARINGS,) range of the nearest point (m, 2) in each part of the view; inf where there is none."""
    angles = np.arctan2(points[:, 1], points[:, 0]) + np.pi
    parts = (angles / (2 * np.pi) * BEARINGS).astype(np.int64) % BEARINGS
    ranges = np.full(BEARINGS, np.inf)
    np.minimum.at(ranges, parts, np.hypot(points[:, 0], points[:, 1]))
    return ranges
