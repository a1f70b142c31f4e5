"""Odometry of which a part stands while the scans move: encoders fail, or a gyroscope."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.held_odometry import held_stretches
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from tests.data import OFFICE_LOG, data_file
from tests.simulation import odometry_faults

POSITION, HEADING = slice(0, 2), slice(2, 3)


@functools.cache
def drive() -> LaserLog:
    return read_log(str(OFFICE_LOG))


def stretches(log: LaserLog) -> list[tuple[int, int]]:
    options = FileCheckOptions()
    return held_stretches(log, options.held, options.steps)


@pytest.mark.parametrize("part", [POSITION, HEADING])
def test_a_part_of_odometry_that_stands_is_found(part):
    rows = slice(len(drive()) // 2, 3 * len(drive()) // 4)
    ((first, last),) = stretches(odometry_faults.partly_held(drive(), rows, part))
    assert abs(first - rows.start) <= 1
    assert abs(last - rows.stop) <= 2


def test_a_robot_that_turns_on_the_spot_holds_its_position():
    """The laser is ahead of the middle, and no step without a turn moves."""
    log = drive()
    assert log.odometry is not None
    turning = np.abs(np.diff(log.odometry[:, 2], append=log.odometry[-1, 2])) > 0.05
    at = int(np.argmax(np.convolve(turning, np.ones(30), "valid")))
    assert stretches(odometry_faults.partly_held(log, slice(at, at + 5), POSITION)) == []


@pytest.mark.logs
@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_no_real_odometry_stands(name):
    assert stretches(read_log(str(data_file(f"{name}.log.gz")))) == []


@pytest.mark.logs
@pytest.mark.parametrize(
    "name", ["mit-csail.log.gz", "mit-killian.log.gz", "fr-clinic.log.gz", "field/urg-corridor-1.bag"]
)
def test_a_gyroscope_that_fails_is_found_in_a_real_log(name):
    log = replace(read_log(str(data_file(name))), odometry_path=None)
    rows = slice(len(log) // 2, None)
    assert stretches(odometry_faults.partly_held(log, rows, HEADING)) == [(rows.start, len(log) - 1)]
