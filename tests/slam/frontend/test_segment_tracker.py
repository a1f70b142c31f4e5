"""Tracking piece by piece; what breaks a track is tested on whole drives in test_trouble."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.segment_tracker import SegmentTracker, tracker_of
from nscan_cli.slam.frontend.tracked_scans import TrackedBatch
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.laser_kinds import HARD
from tests.data import data_file
from tests.logs.excerpts import excerpt, truth_of
from tests.simulation import faults, things_beside
from tests.simulation.drive import Odometry
from tests.simulation.places import drive_through, grounds
from tests.slam.keyframe_drives import round_scene
from tests.slam.mapped_logs import mapped, sensed_in
from tests.slam.trouble_cases import carried, standing


@functools.cache
def scans() -> ScanBatch:
    """40 scans of a drive, and 60 more after the robot was carried by 8 m."""
    made = carried(round_scene().record(5).log(), 20.0, 28.0)
    log = excerpt(made.log, slice(made.before - 40, made.before + 60))
    assert log.odometry is not None
    return sensed_in(log)


def followed(size: int) -> list[TrackedBatch]:
    """All scans, so many at a time; one by one."""
    follower, found, count = SegmentTracker(TrackingOptions(), BreakOptions()), [], len(scans())
    for first in range(0, count, size):
        found += follower.follow(scans().part(first, min(first + size, count)))
    return [settled.one(k) for settled in found + follower.finish() for k in range(len(settled))]


@pytest.mark.parametrize("size", [1, 7, 64])
def test_a_track_breaks_where_it_does_however_many_scans_come_at_a_time(size):
    """Scans that were tracked ahead of a break are tracked anew, as of the piece that begins there."""
    found, together = followed(size), followed(100)
    assert [scan.scans.first for scan in found] == list(range(100))
    assert [scan.scans.first for scan in found if scan.after_break] == [40]
    for one, other in zip(found, together, strict=True):
        assert (one.starts_segment, one.after_break) == (other.starts_segment, other.after_break)
        for of_one, of_other in zip(one.tracked, other.tracked, strict=True):
            np.testing.assert_array_equal(of_one, of_other)


def test_when_all_is_tracked_the_map_goes_and_what_was_counted_stays():
    follower = SegmentTracker(TrackingOptions(), BreakOptions())
    follower.follow(scans())
    counted = follower.restarts, follower.searches
    assert counted > (0, 0)
    assert isinstance(follower.tracker, Tracker)
    assert follower.tracker.map.rows > 0
    follower.finish()
    assert follower.tracker.map.rows == 0
    assert (follower.restarts, follower.searches) == counted


def test_of_a_robot_that_stands_few_scans_wait_for_it_to_drive():
    """They would be kept for hours: the first scan of a piece is placed by those of its first metres."""
    most = TrackingOptions().first_scan_max_count
    log = replace(standing(most + 200), odometry=None)
    follower, settled = SegmentTracker(TrackingOptions(), BreakOptions(), odometry=False), 0
    for first in range(0, len(log), 100):
        settled += sum(map(len, follower.follow(sensed_in(excerpt(log, slice(first, first + 100))))))
        assert settled == (0 if first + 100 < most else first + 100)


@pytest.mark.parametrize("every", [1, 2, 3])
def test_a_person_who_walks_about_a_standing_laser_breaks_no_track(every):
    log = read_log(str(data_file("field/standing.bag")), ReadingOptions(every=every))
    assert mapped(log).state.breaks == []


@pytest.mark.parametrize(
    ("name", "first", "last", "way"), [("carried", 225, 300, 4.3), ("corridor-2", 165, 222, 5.5)]
)
@pytest.mark.parametrize("odometry", [True, False])
def test_a_robot_that_someone_carries_is_tracked_by_what_it_sees(name, first, last, way, odometry):
    """Half of its beams end on whoever holds it. Odometry, its clock put right, stands, or is missing."""
    reading = ReadingOptions(odometry=odometry)
    log = read_log(str(data_file(f"field/urg-{name}.bag")), reading)
    run = mapped(checked_file(log, reading, FileCheckOptions()).log)
    assert run.state.breaks == []
    carried_by = run.graph.poses[last] - run.graph.poses[first]
    assert np.hypot(*carried_by[:2]) == pytest.approx(way, abs=0.4)


def test_matches_that_are_poor_throughout_break_no_track():
    """Outdoors few points lie on Gaussians: a little fewer are no contradiction."""
    sparse = BreakOptions(min_usual_inliers=0.99)
    follower = SegmentTracker(TrackingOptions(), sparse)
    found = follower.follow(scans()) + follower.finish()
    assert not any(batch.after_break for batch in found)


def breaks_of(log: LaserLog) -> list[int]:
    """The rows before which the track breaks."""
    follower = tracker_of(log, SlamOptions())
    found = follower.follow(sensed_in(log)) + follower.finish()
    return [batch.scans.first for batch in found if batch.after_break]


@pytest.mark.parametrize(("since", "until"), [(300, 314), (600, 614), (900, 906)])
def test_a_robot_that_is_carried_outdoors_breaks_the_track(since, until):
    """Where few scans fit well odometry was believed, and the map was 1.6 to 45 m off."""
    log = read_log(str(data_file("fr-campus.log.gz")))
    log = excerpt(log, slice(since - 100, until + 40))
    assert breaks_of(log) == []
    assert breaks_of(faults.carried(log, slice(100, 100 + until - since))) == [100]


def test_so_on_simulated_grounds():
    recording = drive_through(grounds(2), HARD[2].laser, HARD[2].how, Odometry(), 2)
    log = excerpt(recording.log(), slice(400, 560))
    assert breaks_of(log) == []
    assert breaks_of(faults.carried(log, slice(100, 126))) == [100]


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_crowd_about_a_robot_that_stands_breaks_no_track(seed):
    """It hides two thirds of the beams; nobody carries the robot, and scans do not fit together either."""
    log = round_scene().record(5).log()
    rows = np.concatenate([np.arange(200), np.full(80, 200), np.arange(200, len(log))])
    times = np.median(np.diff(log.times)) * np.arange(len(rows))
    log = replace(excerpt(log, rows), times=times, stamps=tuple(f"{time:.6f}" for time in times))
    draw, walkers = np.random.default_rng(seed), np.empty((3 + 2 * seed, 4))
    for walker in walkers:
        angle, away = draw.uniform(0.0, 2.0 * np.pi), draw.uniform(0.5, 0.9)
        walker[:2] = truth_of(log)[200, :2] + away * np.array([np.cos(angle), np.sin(angle)])
        walker[2:] = walker[:2] + draw.normal(0.0, 1.2, 2)
    ranges = log.ranges.copy()
    ranges[210:270] = things_beside.people(log, walkers, speed=0.6).ranges[210:270]
    assert np.mean(ranges[210:270] < log.ranges[210:270] - 0.1) > 0.5
    assert breaks_of(replace(log, ranges=ranges)) == []
