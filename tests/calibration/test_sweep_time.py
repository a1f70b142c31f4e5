"""The time of a laser's sweep as its scans measure it."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.calibration.sweep_time import SweepTime, sweep_time
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from tests.benchmarks.laser_kinds import turning
from tests.data import data_file
from tests.simulation.building import building
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.office import office_way, office_world
from tests.simulation.sweeping import Turning, fine_path, record_swept

PERIOD = 0.2
OPTIONS = SweepCheckOptions()


def measured(log: LaserLog, longest: float = PERIOD) -> SweepTime:
    steps = StepOptions(max_beams=OPTIONS.time.max_beams)
    return sweep_time(ScanMotion.of_log(log, steps, OPTIONS), longest, OPTIONS)


@functools.cache
def by_scans(turn: float, rate: float) -> SweepTime:
    """Of a drive with turns at a rate (rad/s) whose file says nothing of the laser's sweep (s)."""
    path = fine_path(office_way()[:12], Drive(speed=0.22, turn_rate=rate))
    laser = turning(360, 3.5, 0.01, 0.01)
    return measured(
        record_swept("office", office_world(), path, laser, Turning(PERIOD, turn), 1).log(turn=0.0)
    )


@pytest.mark.parametrize("turn", [0.2, 0.13, 0.05, -0.2, 0.0])
@pytest.mark.parametrize("rate", [0.5, 1.5, 2.8])
def test_the_time_comes_out_with_its_standard_deviation(turn, rate):
    found = by_scans(turn, rate)
    assert found.seconds == pytest.approx(turn, abs=3 * found.sigma + 1e-3)
    assert found.sigma < 0.017


@functools.cache
def by_a_laser_in_front() -> LaserLog:
    """A robot at 0.9 m/s turns about its centre, so that its laser, 0.3 m ahead of it, goes aside."""
    place = building(1, 1, 116)
    way = place.crossings([(1, 1), (0, 1), (0, 0), (1, 0)])
    laser = Laser(360, np.pi, -np.radians(1.0), 16.0, noise=0.01, resolution=0.001, mount=(0.3, 0.0, np.pi))
    path = fine_path(way, Drive(speed=0.9, turn_rate=1.0))
    return record_swept("ring", place.world, path, laser, Turning(0.1, 0.1), 116).log(turn=0.0)


def test_a_laser_in_front_of_the_robot_goes_aside_in_turns():
    """Its way was turned by half of the turn in a second, and the time came out 12 % too long."""
    assert measured(by_a_laser_in_front(), 0.1).seconds == pytest.approx(0.1, rel=0.06)


def test_energies_do_not_depend_on_the_order_of_the_times():
    """A match that had slipped with a far too long time was where the next ones began."""
    motion = ScanMotion.of_log(by_a_laser_in_front(), StepOptions(), OPTIONS)
    rows = motion.turning_rows(motion.spread_rows(OPTIONS, OPTIONS.scans), 0.1, OPTIONS)
    sweeps = [0.01 * k for k in range(-14, 15)]
    for row in rows[:3].tolist():
        up, down = motion.energies(row, row - 4, sweeps), motion.energies(row, row - 4, sweeps[::-1])
        assert up is not None
        assert down is not None
        np.testing.assert_array_equal(up, down[::-1])


def test_errors_are_as_large_as_said():
    off = [
        (found.seconds - turn) / found.sigma
        for turn in (0.2, 0.13, 0.05, -0.2, 0.0)
        for rate in (0.5, 1.5, 2.8)
        for found in (by_scans(turn, rate),)
    ]
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 2.0


def test_a_robot_that_stands_does_not_tell():
    path = robot_path(np.linspace(0.0, 20.0, 2_000), np.zeros((2_000, 3)))
    assert path is not None
    recording = record_swept("office", office_world(), path, turning(360, 3.5, 0.01, 0.01), Turning(), 1)
    found = measured(recording.log(turn=0.0))
    assert found.pairs == 0
    assert found.sigma == np.inf


def test_the_file_is_believed_unless_the_scans_contradict_it():
    found = SweepTime(-0.143, 0.004, 60)
    assert found.believed(0.134, 0.135, 3.0) == -0.134
    assert found.believed(-0.14, 0.2, 3.0) == -0.14
    assert found.believed(0.0, 0.135, 3.0) == -0.135
    assert found.believed(0.0, 0.2, 3.0) == -0.143
    assert SweepTime(0.002, 0.004, 60).believed(0.1, 0.1, 3.0) == 0.0
    assert SweepTime(0.0, np.inf, 0).believed(0.1, 0.1, 3.0) == 0.1
    # Every second scan may be missing.
    assert SweepTime(-0.107, 0.004, 60).believed(0.2, 0.2, 3.0) == -0.1


@pytest.mark.parametrize(("name", "turn", "near"), [
    ("field/rplidar-floor", -0.134, 0.015), ("field/urg-corridor-1.bag", 0.1, 0.006),
    ("strangers/sweep-office.mcap", 0.1, 0.005), ("strangers/sweep-none.mcap", 0.0, 0.002),
    ("intel.log.gz", 0.0, 0.005),
])  # fmt: skip
def test_real_lasers(name, turn, near):
    log = read_log(str(data_file(name)), ReadingOptions(sweep=0.0))
    assert measured(log, float(np.median(np.diff(log.times)))).seconds == pytest.approx(turn, abs=near)
