"""Scans that the odometry excludes: where they fit far better, and nowhere else, the robot is."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.poses import Array, relative, transform
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions
from nscan_cli.slam.frontend.segment_tracker import tracker_of
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.options import SlamOptions
from tests.data import data_file
from tests.ndt.wall_points import room
from tests.simulation import faults
from tests.slam.mapped_logs import office_log, sensed, sensed_in

ROW, AFTER = 100, 40


@pytest.mark.parametrize(("since", "until"), [(300, 302), (600, 602), (600, 605), (1500, 1506)])
def test_a_robot_that_is_carried_within_the_local_map_is_found_at_once(since, until):
    """fr-campus without the scans in between, whose odometry stands: the map was up to 0.9 m off."""
    log = excerpt(read_log(str(data_file("fr-campus.log.gz"))), slice(since - ROW, until + AFTER))
    rows = slice(ROW, ROW + until - since)
    carried = faults.carried(log, rows)
    for each in (log, carried):
        follower = tracker_of(each, SlamOptions())
        found = follower.follow(sensed_in(each)) + follower.finish()
        assert not any(batch.after_break for batch in found)
        poses = np.concatenate([batch.tracked.poses for batch in found])
        if each is log:
            step = relative(poses[rows.stop], poses[ROW - 1])
    np.testing.assert_allclose(relative(poses[ROW], poses[ROW - 1]), step, atol=0.1)


def last_pose(at: Array, scan: ScanTrackingOptions) -> Array:
    """(3,) where the last scan of a room is found, taken `at` a pose (3,), after others at the origin.

    Odometry stands.
    """
    scans = [*(room(1) for _ in range(5)), transform(relative(np.zeros(3), at), room(1))]
    tracker = Tracker(TrackingOptions(scan=scan))
    found: Array = tracker.track(sensed(scans, np.zeros((6, 3)))).poses[-1]
    return found


def test_where_odometry_stands_the_robot_is_carried_as_far_as_the_local_map_reaches():
    at = np.array([2.2, -1.1, 0.8])
    np.testing.assert_allclose(last_pose(at, ScanTrackingOptions()), at, atol=0.02)
    assert np.abs(last_pose(at, ScanTrackingOptions(carried_drop=2.0, lost_inliers=0.0)) - at).max() > 0.3


@pytest.mark.parametrize("turn", [1.2, -1.2])
def test_a_scan_out_of_order_is_turned_back_and_the_next_one_is_where_odometry_has_it(turn):
    """So it is on intel, whose odometry knows; where it does not, such scans broke the track."""
    log = excerpt(office_log(), slice(1880, 1960))
    scans = [log.points(row) for row in range(len(log))]
    scans[40] = transform(relative(np.zeros(3), np.array([0.0, 0.0, turn])), scans[40])
    as_said = [
        Tracker(TrackingOptions()).track(sensed(each, log.odometry)).poses
        for each in ([log.points(row) for row in range(len(log))], scans)
    ]
    off = relative(as_said[1], as_said[0])
    np.testing.assert_allclose(off[40], (0.0, 0.0, turn), atol=0.03)
    np.testing.assert_allclose(np.delete(off, 40, axis=0), 0.0, atol=0.03)


def test_the_map_that_fits_elsewhere_nearly_as_well_says_nothing():
    """Piers a metre apart, all alike: the robot may be beside any of them."""
    along = np.arange(-12.0, 12.0, 0.03)
    walls = [np.column_stack([along, np.full(len(along), y)]) for y in (-1.0, 1.5)]
    depths = np.linspace(1.0, 1.5, 18)
    piers = [np.column_stack([np.full(18, x), depths]) for x in np.arange(-11.5, 12.0, 1.0)]
    points = np.concatenate([*walls, *piers])
    view = [points[np.abs(points[:, 0] - x) < 5.0] - [x, 0.0] for x in (0.0, 0.0, 0.0, 0.5)]
    found = Tracker(TrackingOptions()).track(sensed(view, np.zeros((4, 3))))
    assert np.abs(found.poses[-1]).max() < 1.0
