"""Rough turns from scan to scan, by ranges alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.calibration.scan_turns import scan_turns
from nscan_cli.calibration.sweep_options import ScanTurnOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, relative, wrap
from tests.benchmarks.laser_kinds import turning
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.office import office_way, office_world
from tests.simulation.sweeping import Turning, fine_path, record_swept

AHEAD = Laser(100, -np.radians(100), np.radians(2), 12.0)


def drive(laser: Laser) -> LaserLog:
    path = fine_path(office_way()[:5], Drive(speed=0.5, turn_rate=1.5))
    return record_swept("office", office_world(), path, laser, Turning(turn=0.0), 1).log()


def errors(log: LaserLog, apart: int) -> Array:
    first = np.arange(len(log) - apart)
    assert log.truth is not None
    true = relative(log.truth[first + apart], log.truth[first])[:, 2]
    off: Array = np.abs(wrap(scan_turns(log, first, first + apart, ScanTurnOptions()) - true))
    return off


@pytest.mark.parametrize("laser", [turning(360, 8.0, 0.01, 0.05), AHEAD])
def test_turns_are_found_to_two_degrees(laser):
    off = errors(drive(laser), 2)
    assert np.quantile(off, 0.9) < np.radians(2)


def test_readings_that_go_clockwise_turn_the_same_way():
    log = drive(turning(360, 8.0, 0.01, 0.0))
    rows = np.arange(len(log) - 2)
    back = dataclasses.replace(
        log,
        ranges=np.ascontiguousarray(log.ranges[:, ::-1]),
        angle_min=log.angle_min + 359 * log.angle_increment,
        angle_increment=-log.angle_increment,
    )
    np.testing.assert_allclose(
        scan_turns(back, rows, rows + 2, ScanTurnOptions()),
        scan_turns(log, rows, rows + 2, ScanTurnOptions()),
        atol=0.02,
    )


def test_a_scan_has_not_turned_against_itself():
    rows = np.arange(5)
    np.testing.assert_allclose(scan_turns(drive(AHEAD), rows, rows, ScanTurnOptions()), 0.0, atol=1e-6)


def test_between_no_scans_there_are_no_turns():
    none = np.arange(0)
    assert scan_turns(drive(AHEAD), none, none, ScanTurnOptions()).shape == (0,)
