"""Odometry in another unit over a part of a log is put right, and nothing else is taken for it."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_units import checked_units
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, relative
from tests.simulation import odometry_faults
from tests.simulation.scenes import office

OPTIONS = FileCheckOptions()


@functools.cache
def drive() -> LaserLog:
    scene = office()
    return scene.record_at(scene.truth()[:240], 5).log()


def odometry(log: LaserLog) -> Array:
    assert log.odometry is not None
    return log.odometry


STRETCHES = {"120 to 239": slice(120, None), "0 to 60": slice(0, 61), "60 to 150": slice(60, 151)}


@pytest.mark.parametrize("names", STRETCHES)
@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_a_stretch_in_another_unit_is_put_right_and_said(names, factor, unit):
    log = odometry_faults.scaled_in(drive(), factor, STRETCHES[names])
    checked = checked_file(log, ReadingOptions(), OPTIONS)
    np.testing.assert_allclose(odometry(checked.log), odometry(drive()), atol=1e-6)
    (message,) = checked.messages
    assert f"odometry from scan {names} is in {unit}, elsewhere in metres" in message
    assert "--as-recorded" in message


def test_poses_in_another_unit_leave_one_jump():
    poses = odometry(drive()).copy()
    poses[120:, :2] *= 1000.0
    log, said = checked_units(replace(drive(), odometry=poses), OPTIONS.units, OPTIONS.steps)
    assert "from scan 120 to 239 is in millimetres" in said[0]
    steps, recorded = (relative(each[1:], each[:-1]) for each in (odometry(log), odometry(drive())))
    np.testing.assert_allclose(np.delete(steps, 119, 0), np.delete(recorded, 119, 0), atol=1e-6)


def test_the_path_is_put_right_too():
    log = odometry_faults.scaled_in(drive(), 1000.0, slice(120, None))
    log = replace(log, odometry_path=robot_path(log.times, odometry(log)))
    found, _ = checked_units(log, OPTIONS.units, OPTIONS.steps)
    assert found.odometry_path is not None
    np.testing.assert_allclose(found.odometry_path.poses, odometry(drive()), atol=1e-6)


def test_what_scans_do_not_confirm_is_left_alone():
    """As fast as millimetres, but by another factor, or scans of a robot that stands."""
    log = odometry_faults.scaled_in(drive(), 400.0, slice(120, None))
    assert checked_units(log, OPTIONS.units, OPTIONS.steps) == (log, [])
    ranges = drive().ranges.copy()
    ranges[120:] = ranges[120]
    log = replace(odometry_faults.scaled_in(drive(), 1000.0, slice(120, None)), ranges=ranges)
    assert checked_units(log, OPTIONS.units, OPTIONS.steps) == (log, [])


def test_sound_odometry_and_single_jumps_are_left_alone():
    for log in (drive(), odometry_faults.jump(drive(), 100, (500.0, 0.0, 0.0))):
        assert checked_units(log, OPTIONS.units, OPTIONS.steps) == (log, [])


def test_a_log_as_recorded_keeps_its_odometry():
    log = odometry_faults.scaled_in(drive(), 1000.0, slice(120, None))
    checked = checked_file(log, ReadingOptions(as_recorded=True), OPTIONS)
    assert checked.log is log


def test_bounds_are_options():
    log = odometry_faults.scaled_in(drive(), 1000.0, slice(120, None))
    assert checked_units(log, replace(OPTIONS.units, too_fast=1e4), OPTIONS.steps)[1] == []
