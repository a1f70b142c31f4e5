"""Headings by odometry that jump are turned back, and nothing else is taken for such a jump."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.heading_jumps import heading_jumps
from nscan_cli.calibration.odometry_fault_options import HeadingJumpOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, compose, relative, wrap
from tests.calibration.test_file_check import drive
from tests.data import data_file
from tests.logs.excerpts import excerpt

WORDS = "headings by odometry jump"


def jumped(poses: Array, row: int, degrees: float) -> Array:
    found = poses.copy()
    found[row:, 2] = wrap(found[row:, 2] + np.radians(degrees))
    return found


def told(log: LaserLog) -> tuple[LaserLog, list[str]]:
    found = checked_file(log, ReadingOptions(), FileCheckOptions())
    return found.log, [said for said in found.messages if said.startswith(WORDS)]


def with_jumps(log: LaserLog, jumps: list[tuple[int, float]]) -> LaserLog:
    odometry = log.odometry
    assert odometry is not None
    for row, degrees in jumps:
        odometry = jumped(odometry, row, degrees)
    return replace(log, odometry=odometry, odometry_path=None)


def real(name: str, rows: slice) -> LaserLog:
    return replace(excerpt(read_log(str(data_file(name))), rows), odometry_path=None)


DRIVES: dict[str, tuple[Callable[[], LaserLog], int]] = {
    "simulated": (drive, 150),
    "intel": (lambda: real("intel.log.gz", slice(6000, 9000)), 1500),
    "mit-csail": (lambda: real("mit-csail.log.gz", slice(900, 1900)), 500),
    "mit-killian": (lambda: real("mit-killian.log.gz", slice(2000, 3800)), 1200),
    "urg-corridor-1": (lambda: real("field/urg-corridor-1.bag", slice(None)), 385),
}


@pytest.mark.parametrize("degrees", [30.0, -90.0])
@pytest.mark.parametrize("name", list(DRIVES))
def test_they_are_turned_back(name, degrees):
    make, row = DRIVES[name]
    log = make()
    checked, (said,) = told(with_jumps(log, [(row, degrees)]))
    assert f"at scan {log.numbers[row]}" in said
    assert log.odometry is not None
    assert checked.odometry is not None
    off = np.degrees(wrap(checked.odometry[:, 2] - log.odometry[:, 2]))
    assert np.abs(off).max() < 2.0


def test_each_of_two_is():
    log = drive()
    checked, (said,) = told(with_jumps(log, [(100, 40.0), (200, 25.0)]))
    assert said.count(" at scan ") == 2
    assert log.odometry is not None
    assert checked.odometry is not None
    assert np.degrees(np.abs(wrap(checked.odometry[:, 2] - log.odometry[:, 2]))).max() < 2.0


def test_the_path_between_the_scans_is_turned_back_too():
    log = drive()
    assert log.odometry is not None
    faulty = with_jumps(log, [(150, 60.0)])
    assert faulty.odometry is not None
    checked, _ = told(replace(faulty, odometry_path=robot_path(log.times, faulty.odometry)))
    assert checked.odometry_path is not None
    off = wrap(checked.odometry_path.poses[:, 2] - log.odometry[:, 2])
    assert np.degrees(np.abs(off)).max() < 2.0


def test_odometry_that_begins_anew_in_another_frame_has_no_such_jump():
    """Its positions turn with it."""
    odometry = drive().odometry
    assert odometry is not None
    turned = odometry.copy()
    turned[150:] = compose(np.array([0.0, 0.0, 0.7]), odometry[150:])
    assert heading_jumps(turned, HeadingJumpOptions()) == []


def test_a_robot_that_turns_on_the_spot_between_two_poses_has_none():
    steps = np.tile([0.1, 0.0, 0.0], (100, 1))
    steps[50] = 0.0, 0.0, 1.2
    poses = np.zeros((101, 3))
    for k, step in enumerate(steps):
        poses[k + 1] = compose(poses[k], step)
    np.testing.assert_allclose(relative(poses[1:], poses[:-1]), steps, atol=1e-12)
    assert heading_jumps(poses, HeadingJumpOptions()) == []


@pytest.mark.parametrize(
    "name", ["intel.log.gz", "fr-clinic.log.gz", "mit-killian.log.gz", "field/urg-carried.bag"]
)
def test_real_logs_have_none(name):
    odometry = read_log(str(data_file(name))).odometry
    assert odometry is not None
    assert heading_jumps(odometry[np.isfinite(odometry[:, 0])], HeadingJumpOptions()) == []
