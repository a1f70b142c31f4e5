"""Odometry that begins again: two drives in one log, however long the pause between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.slam.frontend.break_options import BreakOptions
from nscan_cli.slam.frontend.odometry_checks import OdometryCheckOptions, restarts_of, without_jumps
from tests.simulation import faults
from tests.slam.keyframe_drives import round_scene


def restarts(log: LaserLog) -> list[int]:
    return [int(row) for row in restarts_of(log, OdometryCheckOptions(), BreakOptions())]


@pytest.fixture(scope="module")
def log() -> LaserLog:
    return round_scene().record(5).log()


def test_another_drive_begins_at_zero_or_where_the_first_one_did(log):
    both = faults.two_drives(log)
    at, odometry = 6 * len(log) // 10, both.odometry
    assert odometry is not None
    assert restarts(both) == [at]
    moved = replace(both, odometry=odometry + np.array([3.0, 4.0, 0.0]))
    assert restarts(moved) == [at]
    odometry = odometry.copy()
    odometry[:at] += (3.0, 4.0, 0.0)
    assert restarts(replace(both, odometry=odometry)) == [at]
    odometry[at] += (0.01, 0.0, 0.0)
    assert restarts(replace(both, odometry=odometry)) == []
    assert restarts(replace(both, odometry=None)) == []


def test_a_robot_may_come_back_to_where_it_began(log):
    """If it sees the same there: both drives begin at one place, and odometry is right."""
    assert restarts(faults.two_drives(log, 0.0)) == []
    assert restarts(log) == []


def test_a_clock_that_is_set_back_puts_the_beginning_at_the_end(log):
    assert log.odometry is not None
    zero = replace(log, odometry=log.odometry - log.odometry[0])
    assert restarts(faults.clock_jump(zero, len(log) // 3, -3600.0)) == []


def test_the_step_to_it_is_not_believed_however_long_the_pause(log):
    both = faults.two_drives(log)
    at, times = 6 * len(log) // 10, both.times.copy()
    times[at:] += 3600.0
    assert both.odometry is not None
    believed, jumps = without_jumps(both.odometry, times, OdometryCheckOptions(), np.array([at]))
    assert jumps.tolist() == [at]
    assert np.abs(np.diff(believed[at - 1 : at + 1], axis=0)).max() < 1.0
