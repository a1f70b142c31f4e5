"""Points of a laser that turns while the robot drives."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.files.provenance import Source
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.laser_log import LaserLog, LogReport
from nscan_cli.logs.robot_path import poses_at
from nscan_cli.logs.sweep import beam_times
from nscan_cli.poses import compose, transform
from tests.logs.test_robot_path import on_circle, path_of
from tests.simulation.recording import START

PERIOD, TURN, BEAMS, WALL = 0.25, 0.2, 60, 4.0
STEP = 2 * np.pi / BEAMS


def log_of_a_wall(times: BeamTimes) -> LaserLog:
    """A robot that drives a circle sees the wall x = 4 m, beam after beam, without noise."""
    scans = np.arange(0.5, 4.0, PERIOD)
    at = scans[:, None] + times.first[:, None] + times.step[:, None] * np.arange(BEAMS)
    fine = np.arange(0.0, 5.0, 0.01)
    path = path_of(START + fine, on_circle(fine))
    mount = np.array([0.1, -0.05, 0.3])
    lasers = compose(on_circle(at.ravel()), mount)
    directions = lasers[:, 2] + np.tile(-np.pi + STEP * np.arange(BEAMS), len(scans))
    with np.errstate(divide="ignore"):
        ranges = (WALL - lasers[:, 0]) / np.cos(directions)
    ranges[(ranges < 0) | (ranges > 12)] = np.inf
    return LaserLog(
        source=Source("wall.log", "", 0),
        format="simulated",
        laser="scan",
        numbers=np.arange(len(scans)),
        stamps=tuple(f"{START + time:.6f}" for time in scans),
        times=START + scans,
        ranges=ranges.reshape(at.shape).astype(np.float32),
        angle_min=np.full(len(scans), -np.pi),
        angle_increment=np.full(len(scans), STEP),
        mount=mount,
        odometry=on_circle(scans),
        no_return=None,
        range_limits=(0.0, 12.0),
        report=LogReport(),
        beam_times=times,
        odometry_path=path,
    )


def times_of(turn: float, stamp: str) -> BeamTimes:
    scans = len(np.arange(0.5, 4.0, PERIOD))
    found = beam_times(np.full(scans, turn), np.full(scans, STEP), np.full(scans, BEAMS), stamp)
    assert found is not None
    return found


def off_the_wall(log: LaserLog) -> float:
    """m, of the point that is farthest off."""
    assert log.odometry is not None
    each = [transform(pose, log.points(row))[:, 0] - WALL for row, pose in enumerate(log.odometry)]
    return float(np.abs(np.concatenate(each)).max())


@pytest.mark.parametrize("turn", [TURN, -TURN])
@pytest.mark.parametrize("stamp", ["first", "middle", "last"])
def test_beams_are_seen_from_where_the_robot_was(turn, stamp):
    log = log_of_a_wall(times_of(turn, stamp))
    assert off_the_wall(log) > 1.0
    assert off_the_wall(log.moving_along(None)) < 1e-5
    assert off_the_wall(log.moving_along(log.odometry)) < 1e-5
    # The motion between the poses of the scans alone is nearly as good.
    assert off_the_wall(dataclasses.replace(log, odometry_path=None).moving_along(log.odometry)) < 1e-5


def test_a_stamp_says_how_much_of_the_turn_is_over():
    spans = {stamp: times_of(TURN, stamp) for stamp in ("first", "middle", "last")}
    lasts = TURN * (BEAMS - 1) / BEAMS
    for stamp, begins in (("first", 0.0), ("middle", -0.5 * lasts), ("last", -lasts)):
        np.testing.assert_allclose(spans[stamp].first, begins, atol=1e-12)
    # In the reverse order the first reading is the last in time.
    np.testing.assert_allclose(times_of(-TURN, "first").first, lasts)
    np.testing.assert_allclose(times_of(-TURN, "last").first, 0.0, atol=1e-12)
    assert beam_times(np.zeros(2), np.full(2, STEP), np.full(2, BEAMS), "first") is None


def test_many_at_a_time_are_the_same_to_the_bit():
    log = log_of_a_wall(times_of(TURN, "first")).moving_along(None)
    for row, points in enumerate(log.points_by_scan()):
        np.testing.assert_array_equal(points, log.points(row))


def test_a_laser_that_sees_at_once_is_left_alone():
    log = log_of_a_wall(times_of(TURN, "first"))
    at_once = dataclasses.replace(log, beam_times=None)
    assert at_once.moving_along(None) is at_once
    unknown = dataclasses.replace(log, odometry=None)
    np.testing.assert_array_equal(unknown.moving_along(None).points(3), at_once.points(3))


def test_only_the_motion_between_poses_matters():
    log = log_of_a_wall(times_of(TURN, "middle"))
    assert log.odometry_path is not None
    there = compose(np.array([5.0, -3.0, 2.0]), poses_at(log.odometry_path, log.times))
    points = log.moving_along(there).points(4)
    np.testing.assert_allclose(points, log.moving_along(None).points(4), atol=1e-5)
