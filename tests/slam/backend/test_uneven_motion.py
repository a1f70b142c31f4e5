"""The path between the middles of the turns of a laser."""

from __future__ import annotations

import dataclasses

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import RobotPath, poses_at, robot_path
from nscan_cli.poses import Array, wrap
from nscan_cli.slam.backend.uneven_motion import path_of_sweeps
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.laser_kinds import turning
from tests.simulation.drive import Drive
from tests.simulation.office import office_way, office_world
from tests.simulation.sweeping import Turning, fine_path, record_swept

WAY_POINTS = 7
RATE = 2.8
"""rad/s"""


def drive() -> tuple[LaserLog, RobotPath]:
    """A robot that begins its turns from one moment to the next; the scans are at the middles of turns."""
    path = fine_path(office_way()[:WAY_POINTS], Drive(speed=0.22, turn_rate=RATE))
    log = record_swept("office", office_world(), path, turning(360, 3.5, 0.01, 0.01), Turning(), 1).log()
    return dataclasses.replace(log, odometry=None, odometry_path=None).at_middle_of_sweeps(), path


def heading_errors(path: RobotPath | None, times: Array, true: RobotPath) -> Array:
    """Degrees."""
    assert path is not None
    off: Array = np.degrees(np.abs(wrap(poses_at(path, times)[:, 2] - poses_at(true, times)[:, 2])))
    return off


def test_headings_between_the_middles_are_found_where_a_turn_begins():
    log, true = drive()
    middles = poses_at(true, log.times)
    between = 0.5 * (log.times[1:] + log.times[:-1])
    steady = heading_errors(robot_path(log.times, middles), between, true)
    finer = heading_errors(path_of_sweeps(log, middles, [], SlamOptions()), between, true)
    assert steady.max() > 4.0
    assert finer.max() < 0.5
    assert np.median(finer) < 0.1


def test_middles_that_are_off_there_are_matched_anew():
    log, true = drive()
    middles = poses_at(true, log.times)
    turn = int(np.argmax(np.abs(np.diff(middles[:, 2])) > 0.1)) + 1
    middles[turn, 2] += 0.1
    found = heading_errors(path_of_sweeps(log, middles, [], SlamOptions()), log.times, true)
    assert found[turn] < 0.2


def test_scans_without_points_and_breaks_leave_the_path_as_it_is():
    log, true = drive()
    middles, ranges = poses_at(true, log.times), np.full_like(log.ranges, np.inf)
    blind = dataclasses.replace(log, ranges=ranges)
    for each, breaks in ((blind, []), (log, list(range(1, len(log))))):
        path = path_of_sweeps(each, middles, breaks, SlamOptions())
        assert path is not None
        np.testing.assert_allclose(poses_at(path, log.times)[:, :2], middles[:, :2], atol=1e-9)


def with_odometry(log: LaserLog, true: RobotPath, period: float) -> LaserLog:
    """The log with true odometry a pose in so many seconds."""
    times = np.arange(true.times[0], true.times[-1], period)
    odometry = robot_path(times, poses_at(true, times))
    return dataclasses.replace(log, odometry=poses_at(true, log.times), odometry_path=odometry)


def test_odometry_is_believed_unless_it_has_hardly_a_pose_a_turn():
    log, true = drive()
    middles = poses_at(true, log.times)
    between = 0.5 * (log.times[1:] + log.times[:-1])
    for period, is_kept in ((0.05, True), (0.2, False)):
        with_poses = with_odometry(log, true, period)
        told = with_poses.moving_along(middles).path
        path = path_of_sweeps(with_poses, middles, [], SlamOptions())
        assert path is not None
        assert told is not None
        assert np.array_equal(path.times, told.times) == is_kept
        assert heading_errors(path, between, true).max() < 1.0
        assert is_kept or heading_errors(told, between, true).max() > 2.0


def test_the_path_stays_where_the_beams_fit_hardly_better():
    log, true = drive()
    middles = poses_at(true, log.times)
    options = SlamOptions()
    uneven = dataclasses.replace(options.uneven_motion, min_gain=1e3)
    path = path_of_sweeps(log, middles, [], dataclasses.replace(options, uneven_motion=uneven))
    assert path is not None
    np.testing.assert_array_equal(path.times, log.times)
