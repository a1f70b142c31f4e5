"""Odometry that counts reversing as driving forward is found by the ranges and put right."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_options import UnsignedOdometryOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.unsigned_odometry import checked_signs, reversed_stretches
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, relative
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation import odometry_faults
from tests.simulation.reversing import there_and_back

STRETCHES = [(40, 80), (200, 260), (270, 280)]
OPTIONS = UnsignedOdometryOptions()


@functools.cache
def reversing() -> LaserLog:
    """A drive in an office that reverses three times, by 1 to 6 m."""
    return there_and_back(excerpt(read_log(str(OFFICE_LOG)), slice(0, 400)), STRETCHES)


def odometry(log: LaserLog) -> Array:
    assert log.odometry is not None
    return log.odometry


def checked(log: LaserLog) -> tuple[LaserLog, list[str]]:
    return checked_signs(log, OPTIONS, StepOptions())


def test_unsigned_odometry_is_put_right() -> None:
    log = odometry_faults.unsigned(reversing())
    corrected, said = checked(log)
    off = relative(odometry(corrected), odometry(reversing()))
    wrong = relative(odometry(log), odometry(reversing()))
    assert np.hypot(wrong[:, 0], wrong[:, 1]).max() > 5.0
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.05
    assert_allclose(odometry(corrected)[:, 2], odometry(log)[:, 2])
    assert len(said) == 1
    assert "counts reversing as driving forward" in said[0]
    assert said[0].count(" to ") == len(STRETCHES)


def test_signs_are_looked_for_once_the_unit_is_put_right() -> None:
    log = odometry_faults.scaled(odometry_faults.unsigned(reversing()), 1000.0)
    whole = checked_file(log, ReadingOptions(), FileCheckOptions())
    off = relative(odometry(whole.log), odometry(reversing()))
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.1
    assert "counts reversing as driving forward" in whole.messages[0]
    assert "--odometry-scale 0.001" in whole.messages[1]


def test_odometry_at_its_own_times_is_put_right_too() -> None:
    log = odometry_faults.unsigned(reversing())
    corrected, _ = checked(replace(log, odometry_path=robot_path(log.times, odometry(log))))
    assert corrected.odometry_path is not None
    assert_allclose(corrected.odometry_path.poses, odometry(corrected), atol=1e-9)


def test_missing_odometry_stays_missing() -> None:
    log = odometry_faults.unsigned(reversing())
    whole, _ = checked(log)
    corrected, _ = checked(odometry_faults.missing(log, slice(300, 320)))
    assert np.isnan(odometry(corrected)[300:320]).all()
    assert_allclose(odometry(corrected)[320:], odometry(whole)[320:], atol=1e-9)


def test_all_beams_are_compared_where_a_few_show_a_reversal() -> None:
    log = odometry_faults.unsigned(reversing())
    assert len(reversed_stretches(log, OPTIONS)) == len(STRETCHES)
    assert not reversed_stretches(log, replace(OPTIONS, first_error_ratio=1e-9))


def test_odometry_that_reverses_is_left_alone() -> None:
    log, said = checked(reversing())
    assert not said
    assert log is reversing()


def test_a_drive_that_never_reverses_is_left_alone() -> None:
    log = read_log(str(OFFICE_LOG))
    assert checked(log)[0] is log


@pytest.mark.parametrize("every", [1, 2, 3])
def test_the_robot_changes_its_direction_where_it_stops(every: int) -> None:
    """However far the scans are apart, odometry is reversed between the stops, and nowhere else."""
    drive = there_and_back(excerpt(read_log(str(OFFICE_LOG)), slice(0, 400)), STRETCHES, stop=9)
    log = excerpt(drive, slice(None, None, every))
    corrected, said = checked(odometry_faults.unsigned(log))
    off = relative(odometry(corrected), odometry(log))
    assert len(said) == 1
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.05


def test_odometry_that_is_wrong_all_over_has_another_cause() -> None:
    """Odometry the wrong way round, or a laser: the check of the file names that."""
    log = odometry_faults.behind(read_log(str(OFFICE_LOG)))
    assert not reversed_stretches(log, OPTIONS)


def test_the_file_as_recorded_is_believed() -> None:
    log = odometry_faults.unsigned(reversing())
    assert "counts reversing" in " ".join(checked_file(log, ReadingOptions(), FileCheckOptions()).messages)
    assert not checked_file(log, ReadingOptions(as_recorded=True), FileCheckOptions()).messages


def test_a_real_robot_without_signs() -> None:
    """fr079's odometry never reverses; its robot does, for 3 m from scan 1403."""
    log = read_log(str(data_file("fr079.log.gz")))
    corrected, said = checked(log)
    assert len(said) == 1
    before, after = (relative(each[1432], each[1403]) for each in (odometry(log), odometry(corrected)))
    assert before[0] == pytest.approx(2.9, abs=0.3)
    assert after[0] == pytest.approx(-2.9, abs=0.3)


@pytest.mark.parametrize("name", ["mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_real_robots_that_never_reverse(name: str) -> None:
    _, said = checked(read_log(str(data_file(f"{name}.log.gz"))))
    assert not said
