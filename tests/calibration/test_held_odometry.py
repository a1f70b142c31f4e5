"""Odometry of which a part stands while the scans move: encoders fail, or a gyroscope."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.held_odometry import checked_held, held_stretches
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.poses import wrap
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


@pytest.mark.parametrize("part", [POSITION, HEADING])
def test_headings_that_have_lost_turns_are_turned_to_the_way_that_the_robot_drives(part):
    """Without that the laser seemed to look elsewhere from there on."""
    log, options = drive(), FileCheckOptions()
    assert log.odometry is not None
    rows = slice(len(log) // 4, len(log) // 2 + 40)
    faulty = odometry_faults.partly_held(log, rows, part)
    checked, said = checked_held(faulty, options.held, options.steps)
    assert len(said) == 1
    assert faulty.odometry is not None
    assert checked.odometry is not None
    behind = slice(rows.stop + 2, None)
    lost = float(wrap(faulty.odometry[-1, 2] - log.odometry[-1, 2]))
    turned = wrap(checked.odometry[behind, 2] - faulty.odometry[behind, 2])
    np.testing.assert_allclose(turned, wrap(-lost), atol=0.03)
    assert (abs(lost) > 0.5) == (part == HEADING)


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
