"""Headings in degrees are told by the way that the robot drives along them, forwards or backwards."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.heading_unit import are_in_degrees
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array
from tests.benchmarks.stranger_cases import siblings


def circles(direction: float = 1.0) -> Array:
    """Poses (400, 3) along two circles of 3 m, whose headings are not wrapped."""
    angles = 4 * np.pi * np.linspace(0.0, 1.0, 400)
    return np.stack([3 * direction * np.sin(angles), -3 * direction * np.cos(angles), angles], axis=1)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_degrees_are_told_by_the_way(direction):
    poses = circles(direction)
    assert not are_in_degrees(poses)
    poses[:, 2] = np.degrees(poses[:, 2])
    assert are_in_degrees(poses)
    poses[:, 2] = np.mod(poses[:, 2] + 180.0, 360.0) - 180.0
    assert are_in_degrees(poses)
    poses[::7] = np.nan
    assert are_in_degrees(poses)


def test_a_robot_that_does_not_drive_along_its_headings_tells_nothing():
    poses = circles()
    poses[:, 2] = np.degrees(poses[:, 2])
    assert not are_in_degrees(poses * (0.001, 0.001, 1.0))
    assert not are_in_degrees(poses * (1.0, -1.0, 1.0))
    assert not are_in_degrees(poses[:3])


def test_a_log_with_headings_in_degrees_is_read_in_radians(tmp_path):
    (case,) = (each for each in siblings(tmp_path) if each.fault == "headings in degrees")
    path = str(case.files(tmp_path)[0])
    log = read_log(path)
    (said,) = log.report.contradictions
    assert said.startswith("the headings of odometry are in degrees")
    assert log.odometry is not None
    headings = np.unwrap(log.odometry[:, 2])
    assert np.abs(np.diff(headings)).max() < 0.5
    as_recorded = read_log(path, ReadingOptions(as_recorded=True))
    assert as_recorded.report.contradictions == ()
    assert as_recorded.odometry is not None
    assert np.abs(as_recorded.odometry - log.odometry).max() > 1.0
