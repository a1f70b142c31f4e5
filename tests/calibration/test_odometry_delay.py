"""Odometry that is stamped some tenths of a second too early or late, beside a laser that sees at once."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import CheckedFile, checked_file
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.odometry_options import ClockOptions, DelayOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.consistency.repeated_maps import mirrored
from tests.calibration.test_file_check import drive
from tests.data import TURNING_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation import odometry_faults


def checked(log: LaserLog, options: FileCheckOptions = FileCheckOptions()) -> CheckedFile:
    return checked_file(log, ReadingOptions(), options)


@pytest.mark.parametrize("seconds", [-0.9, -0.4, 0.4, 0.9])
def test_a_lag_is_put_right_and_said(seconds):
    log = drive()
    found = checked(odometry_faults.late(log, seconds))
    (said,) = found.messages
    assert re.match(rf"odometry is stamped 0\.\d+ s too {'late' if seconds > 0 else 'early'}", said)
    assert found.reading.clock_offset == pytest.approx(-seconds, abs=0.06)
    assert found.log.odometry is not None
    assert log.odometry is not None
    known = np.isfinite(found.log.odometry[:, 0])
    assert known.mean() > 0.95
    off = np.abs(found.log.odometry - log.odometry)[known]
    assert np.quantile(off, 0.9) < 0.03


def test_no_lag_is_found_where_there_is_none_or_nobody_asks():
    log = drive()
    assert checked(log).messages == []
    late = odometry_faults.late(log, 0.6)
    assert checked_file(late, ReadingOptions(as_recorded=True), FileCheckOptions()).messages == []
    never = replace(FileCheckOptions(), lag=DelayOptions(least=np.inf), clock=ClockOptions(min_offset=np.inf))
    assert not [said for said in checked(late, never).messages if said.startswith("odometry is stamped")]
    backwards = odometry_faults.turning(log, -1.0)
    assert not [said for said in checked(backwards).messages if said.startswith("odometry is stamped")]


@pytest.mark.parametrize("every", [1, 2, 3])
def test_it_is_found_where_a_robot_seldom_turns(every):
    """With every second scan few turns were among the first steps, and the map was another one."""
    log = read_log(str(data_file("mit-killian.log.gz")), ReadingOptions(every=every))
    third = excerpt(
        log, slice(0, int(np.searchsorted(log.times, log.times[0] + (log.times[-1] - log.times[0]) / 3)))
    )
    (said,) = [message for message in checked(third).messages if "stamped" in message]
    assert re.match(r"odometry is stamped 0\.6\d? s too early", said)


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "fr-campus", "fr-clinic"])
def test_these_robots_are_not_late(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert not [message for message in checked(log).messages if "stamped" in message]


def test_one_real_robot_is_early_also_in_the_mirrored_world():
    log = read_log(str(data_file("mit-killian.log.gz")))
    for world in (log, mirrored(log)):
        (said,) = (message for message in checked(world).messages if "stamped" in message)
        assert re.match(r"odometry is stamped 0\.6\d s too early", said)


@pytest.mark.parametrize("seconds", [-1.2, -0.45, 0.45, 1.2])
def test_the_lag_of_a_laser_that_turns_is_found_beyond_a_turn(seconds):
    log = read_log(TURNING_LOG)
    found = checked(with_delay(log, seconds))
    assert found.reading.clock_offset == pytest.approx(-seconds, abs=0.05)
