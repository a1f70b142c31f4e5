"""A place in a log behind which odometry is stamped by a clock that was set."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.clock_changes import ClockChange, clock_change
from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.moved_stamps import with_moved_part
from nscan_cli.calibration.odometry_fault_options import ClockChangeOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.turn_differences import Turns
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from tests.calibration.test_file_check import drive
from tests.data import data_file
from tests.simulation import odometry_faults
from tests.simulation.building import building
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.sweeping import Turning, fine_path, record_swept


def set_in(log: LaserLog, seconds: float, begin: float, end: float) -> LaserLog:
    """Odometry is late by so much from one share of the log to another."""
    assert log.odometry is not None
    late = odometry_faults.late(log, seconds).odometry
    assert late is not None
    rows = np.arange(len(log))
    inside = (rows >= begin * len(log)) & (rows < end * len(log))
    return replace(log, odometry=np.where(inside[:, None], late, log.odometry))


def told(log: LaserLog) -> tuple[LaserLog, list[str]]:
    found = checked_file(log, ReadingOptions(), FileCheckOptions())
    return found.log, [said for said in found.messages if "a clock was set there" in said]


@pytest.mark.parametrize(
    ("seconds", "begin", "end", "what"),
    [
        (1.0, 0.5, 1.0, r"stamped (1|0\.9\d|1\.0\d|1\.1) s too late from about scan"),
        (-0.6, 0.4, 1.0, r"stamped 0\.(5|6)\d? s too early from about scan"),
        (2.0, 0.0, 0.4, r"stamped (2|1\.9|2\.1) s too late up to about scan"),
    ],
)
def test_the_part_is_named_and_put_right(seconds, begin, end, what):
    log, (said,) = told(set_in(drive(), seconds, begin, end))
    assert re.search(what, said)
    true = drive().odometry
    assert true is not None
    assert log.odometry is not None
    known = np.isfinite(log.odometry[:, 0])
    off = np.abs(log.odometry - true)[known]
    assert known.mean() > 0.88
    assert np.quantile(off, 0.9) < 0.06


def test_an_offset_of_all_stamps_is_none():
    assert told(drive())[1] == []
    assert told(odometry_faults.late(drive(), 1.0))[1] == []
    assert told(odometry_faults.late(drive(), 5.0))[1] == []


def test_odometry_that_stands_for_a_while_has_one_clock():
    """In 18 s on a few ways round it fits best when it is moved by 3 s."""
    log = read_log(str(data_file("walker.mcap")))
    held = replace(odometry_faults.held(log, slice(30, 61), False), odometry_path=None)
    assert told(held)[1] == []


def test_turns_that_are_alike_are_no_clock_that_was_set():
    """Odometry is 0.02 s early, and turns of a corner are those of the one before, 9.15 s ago: this is a
    multiple of the interval between the offsets that are tried, and 0.02 s is none."""
    laser = Laser(541, -np.radians(135), np.radians(0.5), 30.0, resolution=0.001, mount=(0.3, 0.0, 0.0))
    place = building(1, 1, 113)
    way = place.crossings([(0, 1), (1, 1), (1, 0), (0, 0), (0, 1)])
    path = fine_path(way, Drive(speed=1.5, turn_rate=1.5))
    swept = record_swept("alike", place.world, path, laser, Turning(0.025, 0.025, "last"), 113)
    assert told(swept.log(stamp="first"))[1] == []


def test_odometry_with_times_of_its_own_is_moved_as_well():
    log = drive()
    assert log.odometry is not None
    path = robot_path(log.times, log.odometry)
    middle = float(log.times[len(log) // 2])
    assert path is not None
    moved = with_moved_part(replace(log, odometry_path=path), middle, 0.7, True)
    assert moved.odometry_path is not None
    assert moved.odometry_path.times[-1] == pytest.approx(log.times[-1] + 0.7)
    assert moved.odometry_path.times[0] == log.times[0]
    back = with_moved_part(moved, middle, -0.7, True)
    assert back.odometry_path is not None
    assert np.all(np.diff(back.odometry_path.times) > 0.0)


def test_both_sides_must_tell_it():
    clear = ClockChange(10.0, (9.0, 11.0), 0.0, 1.0, 5.0, 0.2, 0.3, 0.6)
    options = ClockChangeOptions()
    assert clear.is_clear(options.sigmas, options)
    for change in (
        clear._replace(behind=0.2),
        clear._replace(sigmas=1.0),
        clear._replace(left=0.8),
        clear._replace(gain=0.95),
        clear._replace(disagreement=0.05),
    ):
        assert not change.is_clear(options.sigmas, options)


def test_a_turn_at_a_steady_rate_fits_at_other_times_too():
    log = drive()
    at = log.times - log.times[0]
    middles = 0.25 * at[-1], 0.75 * at[-1]
    headings = sum(0.3 * np.clip(at - middle + 6.0, 0.0, 12.0) for middle in middles)
    steady = replace(log, odometry=np.stack([0.0 * at, 0.0 * at, headings], axis=1), odometry_path=None)
    begins = np.concatenate([np.arange(-2.0, 2.0, 0.4) + middle for middle in middles])
    noise = 0.002 * np.random.default_rng(1).standard_normal(len(begins))
    turns = Turns(begins + log.times[0], begins + log.times[0] + 0.4, 0.3 * 0.4 + noise)
    change = clock_change(steady, turns, ClockChangeOptions(), 6)
    assert change is not None
    assert change.disagreement < 0.05


def test_poses_are_left_out_where_it_is_unsure_which_clock_they_have():
    log = drive()
    begin = float(log.times[0])
    at = log.times - begin
    moved = with_moved_part(log, begin + 40.0, 0.0, True, (begin + 38.0, begin + 42.0))
    assert moved.odometry is not None
    known = np.isfinite(moved.odometry[:, 0])
    assert not known[(at > 39.0) & (at < 41.0)].any()
    assert known[(at < 37.0) | (at > 43.0)].all()


@pytest.mark.parametrize("seconds", [-0.6, 1.0, 3.0])
@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel"])
def test_real_drives(name, seconds):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert told(log)[1] == []
    (said,) = told(set_in(log, seconds, 0.5, 1.0))[1]
    assert f"too {'late' if seconds > 0 else 'early'} from about scan" in said
    (scan,) = map(int, re.findall(r"scan (\d+)", said))
    assert abs(scan - len(log) // 2) < 0.1 * len(log)
