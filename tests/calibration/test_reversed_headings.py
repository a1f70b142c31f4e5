"""Headings by odometry that count the wrong way are put right, and nothing else is taken for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_fault_options import ReversedHeadingOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.reversed_headings import contradict_positions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults

WORDS = "odometry counts headings the wrong way"
REVERSED = np.array([1.0, 1.0, -1.0])


def office() -> LaserLog:
    return read_log(str(OFFICE_LOG))


def real() -> LaserLog:
    return excerpt(read_log(str(data_file("intel.log.gz"))), slice(2000, 6000))


def headings_reversed(log: LaserLog) -> LaserLog:
    assert log.odometry is not None
    return replace(log, odometry=log.odometry * REVERSED, odometry_path=None)


@pytest.mark.parametrize("drive", [office, real])
def test_they_are_put_right_and_said(drive):
    log = drive()
    checked = checked_file(headings_reversed(log), ReadingOptions(), FileCheckOptions())
    (said,) = checked.messages
    assert said.startswith(WORDS)
    assert "--as-recorded" in said
    assert checked.log.odometry is not None
    np.testing.assert_allclose(checked.log.odometry, log.odometry)
    assert checked.reading == ReadingOptions()


def test_the_path_between_the_scans_is_put_right_too():
    log = office()
    assert log.odometry is not None
    path = robot_path(log.times, log.odometry * REVERSED)
    faulty = replace(headings_reversed(log), odometry_path=path)
    checked = checked_file(faulty, ReadingOptions(), FileCheckOptions()).log
    assert checked.odometry_path is not None
    np.testing.assert_allclose(checked.odometry_path.poses, log.odometry, atol=1e-9)


def test_the_file_is_believed_where_the_check_is_off():
    never = replace(FileCheckOptions(), headings=ReversedHeadingOptions(min_agreement=2.0))
    checked = checked_file(headings_reversed(office()), ReadingOptions(), never)
    assert checked.log.odometry is None
    recorded = headings_reversed(office())
    as_recorded = checked_file(recorded, ReadingOptions(as_recorded=True), FileCheckOptions())
    assert as_recorded.log.odometry is recorded.odometry


@pytest.mark.parametrize(
    "fault",
    [
        lambda log: log,
        faults.mirrored,
        odometry_faults.x_reversed,
        odometry_faults.behind,
        lambda log: odometry_faults.turning(log, -1.0),
        lambda log: odometry_faults.heading_elsewhere(log, 1.0),
    ],
)
def test_nothing_else_is_taken_for_them(fault):
    messages = checked_file(fault(office()), ReadingOptions(), FileCheckOptions()).messages
    assert not [message for message in messages if message.startswith(WORDS)]


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_these_robots_drive_the_way_that_they_head(name):
    odometry = read_log(str(data_file(f"{name}.log.gz"))).odometry
    assert odometry is not None
    assert not contradict_positions(odometry, ReversedHeadingOptions())
    assert contradict_positions(odometry * REVERSED, ReversedHeadingOptions())
