"""Step 1: every scan against the map of the last metres.

The bounds: a range has a standard deviation of 15 mm, rounded to 10 mm, so that a direction that half of
180 beams constrain is known to 16 mm / √90 = 1.7 mm. A step has two such ends, and the cells make the
Gaussians coarser than the walls: 10 mm is five standard deviations of one end, 4 of a step.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.ndt.grid_growth import make_all_gaussians
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose, relative, transform, wrap
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions
from nscan_cli.slam.frontend.tracked_scans import TrackedScan
from nscan_cli.slam.frontend.tracker import Tracker
from tests.data import data_file
from tests.logs.excerpts import excerpt, truth_of
from tests.ndt.transforms import assert_same, gaussian_count
from tests.ndt.wall_points import room
from tests.simulation.faults import taken
from tests.simulation.scenes import Scene
from tests.simulation.world import Builder
from tests.slam.mapped_logs import office_log, poses_of, scans_of, sensed, sensed_in, tracked

STEP = 0.01
"""m"""
SOUTH = slice(1880, 2080)
"""Rows of the office in which the robot drives 22 m of corridor."""
ROOMS = slice(300, 480)
"""Rows with a visit to a room: doorways and turns on the spot; 17 m."""


def steps_off(found: Array, truth: Array) -> Array:
    """(S − 1, 3) errors of the motion from scan to scan."""
    return relative(relative(found[1:], found[:-1]), relative(truth[1:], truth[:-1]))


def end_off(found: Array, truth: Array) -> Array:
    """(3,) error of the last pose seen from the first."""
    return relative(relative(found[-1], found[0]), relative(truth[-1], truth[0]))


@pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "no odometry"])
@pytest.mark.parametrize("rows", [SOUTH, ROOMS], ids=["corridor", "rooms"])
def test_the_office_is_tracked(rows, odometry):
    """From step to step by the noise of the ranges; over the whole way to 5 cm and 0.01 rad.

    Errors of steps would add up to 10 mm · √200 = 14 cm if the map of the last metres did not hold them.
    """
    log = excerpt(office_log(odometry), rows)
    found, _ = tracked(log)
    truth = truth_of(log)
    off = steps_off(poses_of(found), truth)
    assert np.sqrt((off[:, :2] ** 2).mean(axis=0)).max() < STEP
    assert np.sqrt((off[:, 2] ** 2).mean()) < 0.005
    end = end_off(poses_of(found), truth)
    assert np.hypot(end[0], end[1]) < 0.05
    assert abs(end[2]) < 0.01
    # Only while the map is a scan or two may points find no Gaussian.
    assert min(scan.inliers for scan in found[10:]) > 0.7


@pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "no odometry"])
def test_slips_are_rare(odometry):
    """On the whole way, 240 m, 3 cm (a fourth of a step) is missed where a doorway opens on a new room."""
    log = office_log(odometry)
    found, tracker = tracked(log)
    off = steps_off(poses_of(found), truth_of(log))
    assert (np.hypot(off[:, 0], off[:, 1]) > 0.03).mean() < 0.01
    assert np.abs(off[:, :2]).max() < 0.2
    assert np.abs(off[:, 2]).max() < 0.1
    assert tracker.restarts < 50
    assert tracker.searches == 0 if odometry else tracker.searches < 25


def straight_corridor(scenery: bool) -> LaserLog:
    """20 m along a corridor whose ends are out of sight; with `scenery`, piers at irregular distances."""
    floor = Builder()
    floor.line(-60, -1.1, 60, -1.1)
    floor.line(-60, 1.1, 60, 1.1)
    if scenery:
        for x in (-13.1, -9.7, -6.8, -2.9, 0.3, 3.6, 7.7, 11.2, 16.0):
            floor.box(x, 0.9, x + 0.3, 1.1)
    scene = Scene("straight", floor.world(), np.array([(-10.0, 0.0), (10.0, 0.0)]))
    return scene.record(4).log()


@pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "no odometry"])
def test_a_corridor_with_piers_is_tracked(odometry):
    log = straight_corridor(scenery=True)
    if not odometry:
        log = dataclasses.replace(log, odometry=None)
    found, _ = tracked(log)
    end = end_off(poses_of(found), truth_of(log))
    # Along the corridor a handful of beams see a pier's edge: 2 % of the way.
    assert abs(end[0]) < 0.4
    assert abs(end[1]) < 0.05
    assert abs(end[2]) < 0.01


def test_along_a_bare_corridor_the_odometry_holds_and_the_hessian_says_so():
    log = straight_corridor(scenery=False)
    found, _ = tracked(log)
    truth, poses = truth_of(log), poses_of(found)
    assert log.odometry is not None
    along = np.hypot(*(log.odometry[-1] - log.odometry[0])[:2])
    # Nothing but the odometry tells how far the robot is; the walls hold it back a little only.
    assert np.hypot(*(poses[-1] - poses[0])[:2]) == pytest.approx(along, rel=0.05)
    seen = compose(truth[0], poses)
    assert np.abs(seen[:, 1] - truth[:, 1]).max() < 0.03
    assert np.abs(wrap(seen[:, 2] - truth[:, 2])).max() < 0.01
    for scan in found[1:]:
        assert scan.hessian[0, 0] < 0.05 * scan.hessian[1, 1]


def test_the_first_scan_is_at_the_origin():
    tracker = Tracker(TrackingOptions())
    (first,) = scans_of(tracker.track(sensed([room(1)], np.array([[7.0, -3.0, 2.0]]))))
    np.testing.assert_array_equal(first.pose, 0)
    assert (first.inliers, first.path, first.in_map) == (1.0, 0.0, True)
    alone = Ndt.empty(GaussianOptions(0.5, 5, 0.03))
    alone.add(room(1), np.zeros(3))
    # Tracking makes the Gaussians that it meets, and no others.
    make_all_gaussians(tracker.map.grid, tracker.map.rows, tracker.map.half)
    assert_same(tracker.map, alone)


def test_a_scan_joins_the_map_when_the_robot_has_moved():
    """At 2.4 cm a step every fifth scan is matched 10 cm beyond the last, and the last one at the end."""
    truth = np.zeros((10, 3))
    truth[:, 0] = 0.024 * np.arange(10)
    points = [room(1) - pose[:2] for pose in truth]
    tracker = Tracker(TrackingOptions())
    found = tracker.track(sensed(points, truth))
    assert found.in_map.tolist() == [k in (0, 5, 9) for k in range(10)]
    np.testing.assert_allclose(found.paths, truth[:, 0], atol=0.005)


def window_map(found: list[TrackedScan], log: LaserLog, options: TrackingOptions) -> Ndt:
    """The NDT of just the scans that joined within the window's length of path."""
    gaussians = options.gaussians
    ndt = Ndt.empty(gaussians)
    for row, scan in enumerate(found):
        if scan.in_map and scan.path >= found[-1].path - options.scan.window:
            ndt.add(log.points(row), scan.pose)
    return ndt


def test_the_map_holds_no_more_than_the_scans_of_the_window():
    log = excerpt(office_log(), SOUTH)
    options = TrackingOptions(scan=ScanTrackingOptions(window=4.0))
    found, tracker = tracked(log, options)
    assert found[-1].path > 20
    expected = window_map(found, log, options)
    make_all_gaussians(tracker.map.grid, tracker.map.rows, tracker.map.half)
    # 150 scans came and went: what their sums leave behind is rounding.
    assert_same(tracker.map, expected, tolerance=1e-5)
    assert gaussian_count(tracker.map) < 0.7 * gaussian_count(tracked(log)[1].map)


def jumped(log: LaserLog, row: int, off: tuple[float, float, float]) -> LaserLog:
    """The log with an odometry that sees the step to `row` off by so much; all other steps stay."""
    assert log.odometry is not None
    odometry = log.odometry.copy()
    moved = compose(odometry[row], np.array(off))
    odometry[row:] = compose(moved, relative(log.odometry[row:], log.odometry[row]))
    return dataclasses.replace(log, odometry=odometry)


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_odometry_that_is_off_by_a_radian_is_recovered_by_starts_at_other_angles(turn):
    log = excerpt(jumped(office_log(), 1920, (0.0, 0.0, turn)), slice(1880, 1960))
    truth = truth_of(log)
    found, tracker = tracked(log)
    assert tracker.restarts > 0
    end = end_off(poses_of(found), truth)
    assert np.hypot(end[0], end[1]) < 0.05
    assert abs(end[2]) < 0.01
    # Without these the scan is lost, whatever odometry says, and a search finds it.
    lost, without = tracked(log, TrackingOptions(restart_angles=()))
    assert (tracker.searches, without.restarts) == (0, 0)
    assert without.searches > 0
    assert np.abs(end_off(poses_of(lost), truth)).max() < 0.05
    assert min(scan.inliers for scan in [*found[41:], *lost[41:]]) > 0.7


@pytest.mark.parametrize(
    ("row", "off"), [(1066, (-0.18, 0.45, 0.08)), (1234, (-0.02, 0.42, -0.02))], ids=["a room", "a door"]
)
def test_a_scan_with_fewer_inliers_than_the_one_before_is_matched_from_other_angles_too(row, off):
    """From where odometry has it, it is matched some 0.4 m off, with 0.83 and 0.87 of inliers after 0.99."""
    log = excerpt(jumped(office_log(), row, off), slice(row - 700, row + 1))
    found, _ = tracked(log)
    assert np.abs(end_off(poses_of(found), truth_of(log))).max() < 0.05
    assert found[-1].inliers > found[-2].inliers - ScanTrackingOptions().inlier_margin


def test_without_odometry_a_jump_is_found_by_search():
    """0.9 m and 50° between two scans: further than any widened Gaussian or start from other angles leads."""
    jump, found = np.array([0.9, 0.5, 0.9]), []
    for search in (SearchOptions(distance=1.5, turn=1.5), SearchOptions(distance=0.1, turn=0.1)):
        tracker = Tracker(TrackingOptions(lost_search=search))
        scans = [room(1), room(1), transform(relative(np.zeros(3), jump), room(1))]
        found.append(tracker.track(sensed(scans)).poses[-1])
    np.testing.assert_allclose(found[0], jump, atol=0.02)
    assert np.abs(found[1] - jump).max() > 0.3


def test_a_scan_without_points_is_not_searched():
    tracker = Tracker(TrackingOptions())
    tracker.track(sensed([room(1)]))
    assert tracker.track(sensed([np.empty((0, 2))])).inliers[0] == 0.0
    assert tracker.searches == 0


@pytest.mark.parametrize("odometry", [True, False], ids=["odometry", "no odometry"])
def test_scans_are_found_where_they_are_however_many_come_at_a_time(odometry):
    """To the bit, a lost scan in the middle included; the map and its scans outgrow their first room."""
    log = excerpt(jumped(office_log(), 1920, (0.0, 0.0, 1.0)), slice(1860, 2000))
    log = log if odometry else dataclasses.replace(log, odometry=None)
    scans = sensed_in(log)
    together, _ = tracked(log)
    for size in (1, 7, 64):
        tracker, found = Tracker(TrackingOptions()), []
        for first in range(0, len(log), size):
            found += scans_of(tracker.track(scans.part(first, min(first + size, len(scans)))))
        for one, other in zip(found, together, strict=True):
            for name in ("pose", "hessian", "prior_covariance", "inliers", "path", "in_map"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert tracker.restarts > 0 or not odometry


@pytest.mark.parametrize(("strange", "rings"), [(0.0, 1), (0.2, 3), (0.5, 3)])
def test_far_angles_are_tried_when_most_points_of_a_scan_are_none_of_the_map(strange, rings):
    """Somewhat fewer inliers than before are no reason to doubt the angle by more than some degrees.

    Of the points of one scan alone 68 % lie on Gaussians of five points or more.
    """
    points = room(1).copy()
    gone = np.arange(len(points)) % 20 < 20 * strange
    points[gone] = np.random.default_rng(3).uniform(20, 30, (np.count_nonzero(gone), 2))
    tracker = Tracker(TrackingOptions())
    found = tracker.track(sensed([room(1), points], np.zeros((2, 3)))).scan(1)
    assert found.inliers == pytest.approx(0.68 * (1 - strange), abs=0.05)
    assert tracker.restarts == rings
    np.testing.assert_allclose(found.pose, 0, atol=0.02)


def test_without_odometry_a_clear_drop_of_inliers_starts_a_match_again():
    """Of fr079, every second scan alone: where its turn changes direction a match ends 0.25 m off, at 0.82.

    After 0.97 that is a drop. Every scan tells where the robot was.
    """
    log = dataclasses.replace(read_log(str(data_file("fr079.log.gz"))), odometry=None)
    rows = np.arange(700, 860)
    dense, sparse = (poses_of(tracked(taken(log, rows[::every]))[0])[:: 3 - every] for every in (1, 2))
    assert np.abs(steps_off(dense, sparse)).max() < 0.05
