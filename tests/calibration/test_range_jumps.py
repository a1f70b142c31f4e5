"""Ranges that all change by one factor from one scan to the next are put into one scale."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.compared_ranges import compare_ranges
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.range_jumps import RangeJump, checked_ranges, range_jumps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults
from tests.slam.keyframe_drives import round_scene

OPTIONS = FileCheckOptions()


@functools.cache
def drive() -> LaserLog:
    return round_scene().record(5).log()


def jumps_of(log: LaserLog) -> list[RangeJump]:
    return range_jumps(log, compare_ranges(log, OPTIONS), OPTIONS)


def checked(log: LaserLog) -> tuple[LaserLog, list[str]]:
    return checked_ranges(log, compare_ranges(log, OPTIONS), OPTIONS)


@pytest.mark.parametrize("factor", [0.9, 0.95, 1.05, 1.1, 1.5])
@pytest.mark.parametrize("odometry", [True, False])
def test_the_scan_and_the_factor_are_found(factor, odometry):
    log = drive() if odometry else replace(drive(), odometry=None)
    at = len(log) // 2
    (jump,) = jumps_of(faults.ranges_scaled(log, factor, slice(at, None)))
    assert jump.row == at
    assert jump.factor == pytest.approx(factor, rel=0.004)


def test_the_shorter_part_is_put_right_and_said():
    log = drive()
    at = len(log) // 3
    right, said = checked(faults.ranges_scaled(log, 1.05, slice(at, 2 * at)))
    assert len(said) == 1
    assert said[0].startswith(f"the ranges of scans {at} to {2 * at - 1} are 1.05 times the others")
    assert "--range-scale 1.05" in said[0]
    np.testing.assert_allclose(right.ranges, log.ranges, rtol=0.004)


def test_odometry_tells_the_right_part_where_the_factor_is_large():
    log = drive()
    scaled = faults.ranges_scaled(log, 1.5, slice(len(log) // 4, None))
    right, said = checked(scaled)
    assert said[0].startswith(f"the ranges of scans {len(log) // 4} to {len(log) - 1} are 1.5 times")
    np.testing.assert_allclose(right.ranges, log.ranges, rtol=0.004)
    _, said = checked(replace(scaled, odometry=None))
    assert said[0].startswith(f"the ranges of scans 0 to {len(log) // 4 - 1} are 0.66")


def test_a_factor_beside_another_one_is_none():
    log = drive()
    scaled = faults.ranges_scaled(log, 1.1, slice(len(log) // 2, None))
    compared = compare_ranges(scaled, OPTIONS)
    assert range_jumps(scaled, compared, OPTIONS)
    beside = compared.logarithms.copy()
    beside[len(log) // 2] = -0.9 * np.log(1.1)
    assert not range_jumps(scaled, compared._replace(logarithms=beside), OPTIONS)


def test_a_wrong_step_of_odometry_is_no_change():
    log = drive()
    for jump in ((0.3, 0.0, 0.0), (0.0, -0.3, 0.1)):
        wrong = odometry_faults.jump(log, len(log) // 2, jump)
        assert checked(wrong)[1] == []


def test_odometry_on_another_clock_is_none():
    """Beside a pause of the laser this odometry says 1.4 m in place of 0.2 m."""
    log = excerpt(read_log(str(data_file("fr-clinic.log.gz"))), slice(1500, 3300))
    assert jumps_of(odometry_faults.late(log, 12.0)) == []


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_no_real_log_changes(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert jumps_of(log) == []


@pytest.mark.parametrize(
    ("name", "place"), [("intel", 0.3), ("fr079", 0.5), ("fr-clinic", 0.25), ("mit-csail", 0.7)]
)
def test_it_is_found_in_a_real_log(name, place):
    log = read_log(str(data_file(f"{name}.log.gz")))
    at = int(place * len(log))
    (jump,) = jumps_of(faults.ranges_scaled(log, 1.1, slice(at, None)))
    assert jump.row == at
    assert jump.factor == pytest.approx(1.1, rel=0.01)
