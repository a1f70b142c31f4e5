"""A match leaves odometry that has proved good only for a gain that is worth it."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions
from nscan_cli.slam.frontend.tracker import Tracker
from tests.slam import trouble_cases
from tests.slam.mapped_logs import sensed, tracked

STEP = 0.2
"""Way from scan to scan, m."""
SCANS = 112
END = 26.0
"""Where the wall at the end of the corridor is, m."""
VIEW = 6.0
"""m"""


def corridor(at: float, end: float, end_points: int, rng: np.random.Generator) -> Array:
    """Points (m, 2) seen `at` some place (m) of a corridor that is bare after 14 m.

    Its end is in view from 20 m on.
    """
    along = np.arange(np.ceil((at - VIEW) / 0.06) * 0.06, at + VIEW, 0.06)
    parts = [np.column_stack([along, np.full(len(along), side)]) for side in (-1.1, 1.1)]
    piers = np.arange(-VIEW, 14.0, 1.7)
    piers += 0.3 * np.sin(piers)
    depths = np.linspace(0.8, 1.1, 6)
    seen = piers[np.abs(piers - at) < VIEW]
    parts.append(np.column_stack([np.repeat(seen, len(depths)), np.tile(depths, len(seen))]))
    if end - at < VIEW:
        parts.append(np.column_stack([np.full(end_points, end), np.linspace(-0.8, 0.8, end_points)]))
    points = np.concatenate(parts) - [at, 0.0]
    return points + rng.normal(0.0, 0.01, points.shape)


def last_pose(end_points: int, odometry_stands: bool = False, max_odometry_surprise: float = 25.0) -> Array:
    """(3,) off odometry, where the robot comes 0.3 m nearer to the end with the last scan than it says.

    Or as much nearer as odometry stands still then.
    """
    rng = np.random.default_rng(1)
    places = STEP * np.arange(SCANS)
    odometry = np.column_stack([places, np.zeros((SCANS, 2))])
    if odometry_stands:
        odometry[-1] = odometry[-2]
        places[-1] = places[-2]
    scans = [corridor(at, END, end_points, rng) for at in places[:-1]]
    scans.append(corridor(places[-1], END - 0.3, end_points, rng))
    scan = ScanTrackingOptions(max_odometry_surprise=max_odometry_surprise)
    found = Tracker(TrackingOptions(scan=scan)).track(sensed(scans, odometry))
    off: Array = found.poses[-1] - odometry[-1]
    return off


def test_something_that_comes_nearer_does_not_outweigh_good_odometry():
    """60 points of 440 say that the robot went 0.3 m farther. The odometry was exact for 22 m."""
    assert abs(last_pose(60)[0]) < 0.03
    assert last_pose(60, max_odometry_surprise=0.0)[0] == pytest.approx(0.3, abs=0.03)


def test_a_clear_view_outweighs_it():
    assert last_pose(140)[0] == pytest.approx(0.3, abs=0.03)


def test_odometry_that_stands_outweighs_nothing():
    """It does so where the robot is carried."""
    assert last_pose(60, odometry_stands=True)[0] == pytest.approx(0.3, abs=0.03)


def test_scans_of_a_robot_that_stands_are_not_all_matched_from_other_angles():
    """A map of one noisy scan explains 0.82 of the points of the next ones, from any angle. 100 were."""
    _, tracker = tracked(trouble_cases.standing(600))
    assert tracker.restarts < 20
