"""Step 1 without odometry: scans that do not tell their place wait for later ones, which tell it from behind.

Tracking goes on meanwhile. Only if the track from behind is the better one, it goes back to the scans that
waited, and tracks them along that.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from nscan_cli.slam.frontend.motion_from_behind import (
    MotionFromBehind,
    count_before_doubt,
    motion_from_behind,
)
from nscan_cli.slam.frontend.options import LaserView, TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedBatch, TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker


class TwoSidedTracker:
    """Follows the robot without odometry, forward and, where that fits better, from behind."""

    def __init__(self, options: TrackingOptions, laser: LaserView | None = None) -> None:
        self.options, self._laser = options, laser
        self._forward = self._new_tracker()
        self._is_start = True
        """Whether no scan is settled yet."""
        self._checkpoints: list[tuple[int, Tracker]] = []
        """The tracker as it was before some scan, and that scan's row in the log. The first is before all
        that waits."""
        self._fresh: list[ScanBatch] = []
        """The scans after each checkpoint, as they were before they were corrected."""
        self._waiting: list[TrackedBatch] = []
        """The scans that wait, as they were tracked so far: at most one batch."""

    @property
    def restarts(self) -> int:
        """Matches started from other angles."""
        return self._forward.restarts

    @property
    def searches(self) -> int:
        """Searches for a lost scan."""
        return self._forward.searches

    def track(self, scans: ScanBatch, may_wait: bool = False) -> TrackedScans:
        """Track the next scans, the first of which are those that waited.

        Of the last ones, which may wait for scans after them, nothing is found.
        """
        ahead = self._track_ahead(scans)
        known = len(ahead)
        if may_wait and known < self.options.standstill_scans:
            known = count_before_doubt(ahead.tracked, self.options, self._is_start)
        self._is_start &= known == 0
        settled, self._waiting, motion = ahead.part(0, known), [], None
        if known:
            fresh = self._fresh_scans(scans.first, scans.first + known)
            motion = motion_from_behind(fresh, settled.tracked, self._new_tracker(), self.options)
        if motion is not None and motion.unproven:
            along = copy.deepcopy(self)._track_along(fresh.copied(), motion).tracked
            motion = motion.where_proven(
                settled.tracked.values, along.values, self.options.standstill_evidence
            )
        if motion is not None:
            settled = self._track_along(fresh, motion)
        elif known < len(ahead):
            self._waiting = [ahead.part(known, len(ahead))]
            self._forget(scans.first + known)
        else:
            self._checkpoints, self._fresh = [], []
        scans.correct(settled.scans)
        return settled.tracked

    def _new_tracker(self) -> Tracker:
        return Tracker(self.options, False, self._laser)

    def _track_ahead(self, scans: ScanBatch) -> TrackedBatch:
        """All these scans as tracked from the front: those that waited were tracked before."""
        parts = self._waiting
        new = scans.part(sum(map(len, parts)), len(scans))
        if len(new):
            self._checkpoints.append((new.first, copy.deepcopy(self._forward)))
            self._fresh.append(new.copied())
            corrected = new.copied()
            parts = [*parts, TrackedBatch(corrected, self._forward.track(corrected))]
        together = ScanBatch.together([part.scans for part in parts])
        return TrackedBatch(together, TrackedScans.together(part.tracked for part in parts))

    def _track_along(self, fresh: ScanBatch, motion: MotionFromBehind) -> TrackedBatch:
        """Go back to the first of some scans, and track them along a motion. Later ones are tracked again."""
        self._forget(fresh.first)
        row, self._forward = self._checkpoints[0]
        if row < fresh.first:
            self._forward.track(self._fresh_scans(row, fresh.first))
        found = self._forward.track(replace(fresh, odometry=motion.poses))
        np.maximum(found.weakest_sigmas, motion.weakest_sigmas, out=found.weakest_sigmas)
        self._checkpoints, self._fresh = [], []
        return TrackedBatch(fresh, found)

    def _fresh_scans(self, first: int, end: int) -> ScanBatch:
        """A copy of scans in rows from `first` on, before `end`, as they were before they were corrected."""
        since = ScanBatch.together(self._fresh)
        return since.part(first - since.first, end - since.first)

    def _forget(self, row: int) -> None:
        """Drop the checkpoints, and the scans since, that are not needed to go back to the scan in a row."""
        earlier = sum(first <= row for first, _ in self._checkpoints) - 1
        del self._checkpoints[:earlier], self._fresh[:earlier]
