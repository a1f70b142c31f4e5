"""The tracker without odometry, which goes back to scans that waited only where that helps."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest

from nscan_cli.slam.frontend.motion_from_behind import (
    MotionFromBehind,
    count_before_doubt,
    motion_from_behind,
)
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch, scan_batches
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.frontend.two_sided_tracker import TwoSidedTracker
from tests.simulation.drive import Drive
from tests.simulation.scenes import tee

OPTIONS = TrackingOptions()
SWEPT = [False, True]


def drive_in_corridor(swept: bool) -> ScanBatch:
    """Down a bare corridor towards a wall far ahead; swept scans have times of their points."""
    log = dataclasses.replace(tee(), drive=Drive(speed=0.55, period=0.2)).record(1).log()
    scans = ScanBatch.together(list(scan_batches(log, OPTIONS, None, np.zeros(0, dtype=np.int64))))
    return dataclasses.replace(scans, shares=np.linspace(-0.4, 0.4, len(scans.points))) if swept else scans


def batches(scans: ScanBatch, size: int) -> list[tuple[int, bool]]:
    """The end of each batch, and whether its last scans may wait."""
    ends = [*range(size, len(scans), size), len(scans)]
    return [(end, end < len(scans)) for end in ends]


def tracked(scans: ScanBatch, size: int) -> TrackedScans:
    """What `TwoSidedTracker` finds, batch by batch."""
    tracker, found, row = TwoSidedTracker(OPTIONS), [], 0
    for end, may_wait in batches(scans, size):
        found.append(tracker.track(scans.part(row, end), may_wait))
        row += len(found[-1].values)
    assert row == len(scans)
    return TrackedScans.together(found)


def tracked_anew(scans: ScanBatch, size: int) -> TrackedScans:
    """The same the long way: scans that wait are tracked again with each batch, after those before them."""
    tracker, found, row = Tracker(OPTIONS, False), [], 0
    for end, may_wait in batches(scans, size):
        before, waiting = copy.deepcopy(tracker), scans.part(row, end).copied()
        ahead = tracker.track(waiting.copied())
        known = count_before_doubt(ahead, OPTIONS, row == 0) if may_wait else end - row
        tracker = before
        if not known:
            continue
        settled = scans.part(row, row + known)
        motion = motion_from_behind(settled.copied(), ahead.part(0, known), Tracker(OPTIONS, False), OPTIONS)
        if motion is not None and motion.unproven:
            tried = copy.deepcopy(tracker).track(dataclasses.replace(settled.copied(), odometry=motion.poses))
            motion = motion.where_proven(ahead.values[:known], tried.values, OPTIONS.standstill_evidence)
        along = settled if motion is None else dataclasses.replace(settled, odometry=motion.poses)
        found.append(tracker.track(along))
        if motion is not None:
            np.maximum(found[-1].weakest_sigmas, motion.weakest_sigmas, out=found[-1].weakest_sigmas)
        row += known
    return TrackedScans.together(found)


def test_a_motion_that_fits_as_well_counts_where_scans_along_it_fit_better():
    poses, sigmas = np.arange(120.0).reshape(40, 3), np.ones(40)
    motion = MotionFromBehind(poses, sigmas, [(2, 8), (20, 25)])
    front, along = np.zeros(40), np.zeros(40)
    # The second stretch fits, but not what comes after it: its map is wrong.
    along[2:8], along[20:25], along[25:30] = -2.0, -4.0, 3.0
    proven = motion.where_proven(front, along, 10.0)
    assert proven is not None
    assert not proven.unproven
    assert np.flatnonzero(np.isnan(proven.poses[:, 0])).tolist() == list(range(19, 26))
    assert np.flatnonzero(proven.weakest_sigmas == 0.0).tolist() == list(range(19, 26))
    assert np.isfinite(motion.poses).all(), "the motion itself stays"


def test_no_motion_is_left_without_proof():
    whole = MotionFromBehind(np.full((10, 3), np.nan), np.zeros(10), [(3, 6)])
    whole.poses[2:7] = 0.0
    assert whole.where_proven(np.zeros(10), np.full(10, -1.0), 10.0) is None


@pytest.mark.parametrize("swept", SWEPT)
@pytest.mark.parametrize("size", [10, 37])
def test_going_back_to_scans_gives_what_tracking_all_that_wait_again_would(size, swept):
    scans, anew = drive_in_corridor(swept), drive_in_corridor(swept)
    found, expected = tracked(scans, size), tracked_anew(anew, size)
    for column, wanted in zip(found, expected, strict=True):
        np.testing.assert_array_equal(column, wanted)
    np.testing.assert_array_equal(scans.points, anew.points)
    plain = Tracker(OPTIONS, False).track(drive_in_corridor(swept))
    assert found.paths[-1] > plain.paths[-1] + 2.0, "the track from behind has led none of them"


def test_scans_that_wait_are_tracked_once_unless_it_helps_to_go_back(monkeypatch):
    scans, count, track = drive_in_corridor(False), [], Tracker.track

    def counted(tracker, batch, may_wait=False):
        count.append(len(batch))
        return track(tracker, batch, may_wait)

    monkeypatch.setattr(Tracker, "track", counted)
    monkeypatch.setattr("nscan_cli.slam.frontend.two_sided_tracker.motion_from_behind", lambda *given: None)
    tracked(scans, 10)
    assert sum(count) == len(scans)
