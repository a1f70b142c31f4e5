"""Odometry whose clock is not that of the scans."""

from __future__ import annotations

import re

import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.simulation import faults, odometry_faults
from tests.slam.keyframe_drives import round_scene


def found(log: LaserLog) -> list[str]:
    return checked_file(log, ReadingOptions(), FileCheckOptions()).messages


def test_a_late_clock_is_found_though_most_turns_agree():
    """A robot that stands turns as its odometry, whatever the clocks."""
    log = read_log(str(data_file("mit-killian.log.gz")))
    (said,) = found(odometry_faults.late(log, 3.0))
    assert re.search(r"ahead.*--clock-offset -2\.\d", said)


def test_a_late_clock_of_a_mirrored_drive_is_found():
    drive = round_scene().record(5).log()
    late, mirrored = found(faults.mirrored(odometry_faults.late(drive, 3.0)))
    assert "try --clock-offset -3.0" in late
    assert "in the wrong order" in mirrored


@pytest.mark.parametrize("name", ["urg-carried.bag", "urg-corridor-1.bag", "urg-corridor-2.bag"])
def test_the_odometry_of_this_robot_is_late_and_nothing_else(name):
    (late,) = found(read_log(str(data_file(f"field/{name}"))))
    assert re.match("odometry is stamped 0.1[2-6] s too early", late)
