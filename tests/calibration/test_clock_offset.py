"""Odometry whose clock is not that of the scans."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import CheckedFile, checked_file
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import are_known
from tests.data import data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults
from tests.slam.keyframe_drives import round_scene


def checked(log: LaserLog, reading: ReadingOptions | None = None) -> CheckedFile:
    return checked_file(log, reading or ReadingOptions(), FileCheckOptions())


@pytest.mark.parametrize("seconds", [30.0, 2.0, -2.0, -12.0])
@pytest.mark.parametrize("has_path", [False, True])
def test_two_clocks_are_made_one_and_what_is_said_reads_the_file_so(seconds, has_path):
    log = round_scene().record(5).log()
    odometry = log.odometry
    assert odometry is not None
    log = replace(log, odometry_path=robot_path(log.times, odometry) if has_path else None)
    found = checked(with_delay(log, seconds))
    assert found.reading.clock_offset == pytest.approx(-seconds, abs=0.12)
    (said,) = found.messages
    assert f"as with --clock-offset {found.reading.clock_offset:g}, " in said
    assert found.log.odometry is not None
    known = are_known(found.log.odometry)
    # What another clock said beyond the ends of the scans is lost, unless odometry has its own times.
    lost = 0.0 if has_path else abs(seconds) / float(np.ptp(log.times))
    assert 1.0 - known.mean() == pytest.approx(lost, abs=0.01)
    off = np.abs(found.log.odometry - odometry)[known]
    assert np.quantile(off[:, :2], 0.9) < 0.03


def test_an_offset_that_the_user_gave_is_left_and_a_better_one_named():
    log = odometry_faults.late(round_scene().record(5).log(), 3.0)
    found = checked(log, ReadingOptions(clock_offset=1.0))
    (said,) = found.messages
    assert "try --clock-offset -2.0" in said
    assert found.reading.clock_offset == 1.0
    assert found.log is log


def test_a_clock_is_told_by_the_turns_that_odometry_has():
    """In a third of the log it stands."""
    log = excerpt(read_log(str(data_file("mit-csail.log.gz"))), slice(900, 1700))
    late = odometry_faults.late(replace(log, odometry_path=None), 2.0)
    found = checked(odometry_faults.held(late, slice(266, 533), False))
    assert found.reading.clock_offset == pytest.approx(-1.9, abs=0.15)
    assert not [said for said in found.messages if "elsewhere" in said or "contradicts" in said]


def test_odometry_that_begins_late_by_its_clock_does_not_stand():
    log = read_log(str(data_file("field/urg-corridor-1.bag")))
    log = odometry_faults.late(replace(log, beam_times=None, odometry_path=None), 30.0)
    found = checked(faults.mirrored(log))
    assert found.reading.clock_offset == pytest.approx(-29.9, abs=0.1)
    assert "try --flip" in found.messages[-1]
    assert not [said for said in found.messages if "stands still" in said]


def test_a_late_clock_is_found_though_most_turns_agree():
    """A robot that stands turns as its odometry, whatever the clocks."""
    log = read_log(str(data_file("mit-killian.log.gz")))
    (said,) = checked(odometry_faults.late(log, 3.0)).messages
    assert re.search(r"too late.*--clock-offset -2\.\d", said)


@pytest.mark.parametrize("seconds", [2.0, -2.0])
def test_a_late_clock_is_found_where_the_robot_turns_steadily(seconds):
    """Turns agree at other times, too, and positions do not, of which some were multiplied by 865."""
    log = read_log(str(data_file("walker.mcap")))
    late = odometry_faults.late(replace(log, odometry_path=None), seconds)
    assert late.odometry is not None
    (said,) = checked(replace(late, odometry=np.round(late.odometry, 4))).messages
    assert re.match(r"odometry is stamped (1\.9|2|2\.1) s too", said)


def test_a_late_clock_of_a_mirrored_drive_is_found():
    drive = round_scene().record(5).log()
    late, mirrored = checked(faults.mirrored(odometry_faults.late(drive, 3.0))).messages
    assert "as with --clock-offset -3" in late
    assert "in the wrong order" in mirrored


@pytest.mark.parametrize("name", ["urg-carried.bag", "urg-corridor-1.bag", "urg-corridor-2.bag"])
def test_the_odometry_of_this_robot_is_late_and_nothing_else(name):
    (late,) = checked(read_log(str(data_file(f"field/{name}")))).messages
    assert re.match("odometry is stamped 0.1[2-6] s too early", late)
