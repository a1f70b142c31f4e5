"""Recordings of others, whole and in parts, of which nothing may be said that is not so."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_options import ViewChangeOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.sweep_evidence import SweepEvidence
from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.calibration.view_change import direction_change
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.laser_kinds import HARD, recorded
from tests.calibration.test_file_check import drive
from tests.data import CORRIDOR_LOG, OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults
from tests.simulation.scenes import bare_corridor

RANGES, ORDER, DIRECTION = "the ranges of scans", "come in the other order", "behind a place"
AT_ONCE, CLOCK, MIRRORED = "sees all beams at once", r"stamped (0\.[5-9]|[1-9])", "mirrored"
REAL = ("intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic")


@pytest.mark.parametrize(
    ("name", "every", "odometry", "part", "alarm"),
    [
        ("fr-clinic.log.gz", 2, True, (0, 1), RANGES),
        ("fr-clinic.log.gz", 2, True, (2, 3), RANGES),
        ("fr-clinic.log.gz", 2, True, (5, 7), RANGES),
        ("intel.log.gz", 4, False, (0, 1), ORDER),
        ("intel.log.gz", 5, False, (0, 1), ORDER),
        ("field/rplidar-floor", 7, False, (0, 1), ORDER),
        ("field/rplidar-hallway.bag", 1, False, (4, 5), AT_ONCE),
        ("field/rplidar-hallway.bag", 1, False, (8, 9), AT_ONCE),
        ("field/urg-corridor-2.bag", 1, True, (3, 9), AT_ONCE),
        ("field/urg-carried.bag", 2, False, (4, 7), AT_ONCE),
        ("field/urg-corridor-2.bag", 1, True, (2, 9), CLOCK),
        ("field/urg-corridor-2.bag", 1, True, (2, 9), MIRRORED),
        ("field/urg-corridor-1.bag", 1, True, (2, 5), DIRECTION),
        ("field/player-2.1.2.log", 1, True, (1, 2), DIRECTION),
    ],
)
def test_a_sound_recording_is_not_contradicted(name, every, odometry, part, alarm):
    reading = ReadingOptions(every=every, odometry=odometry)
    log = read_log(str(data_file(name)), reading)
    number, parts = part
    rows = slice(number * len(log) // parts, (number + 1) * len(log) // parts)
    messages = checked_file(excerpt(log, rows), reading, FileCheckOptions()).messages
    assert not [message for message in messages if re.search(alarm, message)]


def test_ground_that_a_pitching_robot_sees_is_no_change_of_the_ranges():
    grounds = next(kind for kind in HARD if kind.name.startswith("grounds"))
    log, _ = recorded(grounds, 2, "poor")
    near = excerpt(log, slice(1270, 1470))
    assert not checked_file(near, ReadingOptions(), FileCheckOptions()).messages


@pytest.mark.parametrize(("seed", "part"), [(1, slice(None)), (3, slice(2430, 3650))])
def test_matches_that_failed_where_the_robot_drives_straight_on(seed, part):
    """They turn where the robot does not: the laser could be anywhere, and odometry useless."""
    grounds = next(kind for kind in HARD if kind.name.startswith("grounds"))
    log, _ = recorded(grounds, seed, "good")
    assert not checked_file(excerpt(log, part), ReadingOptions(), FileCheckOptions()).messages


def test_pairs_that_begin_with_one_scan_count_once():
    turns, gains = np.array([0.0, 0.1]), np.array([0.1, 0.11, 0.09, 0.1, 0.11, 0.1])
    energies = np.stack([-gains, np.zeros(6)], axis=1)
    few = SweepEvidence(turns, energies, np.array([7, 9, 7, 9, 7, 9]), SweepCheckOptions())
    assert few.is_little
    assert few.sigmas(0.0, 0.1) == 0.0
    assert replace(few, first=np.arange(6)).sigmas(0.0, 0.1) > 10.0


def test_headings_that_drift_to_and_fro_are_no_turn_of_the_laser():
    rng, count = np.random.default_rng(3), 96
    laser = np.stack([np.full(count, 0.2), np.zeros(count), np.zeros(count)], axis=1)
    laser[:, :2] += rng.normal(0.0, 0.002, (count, 2))
    drift = np.where(np.arange(count) // 8 % 3 == 0, 0.06, 0.0) + np.where(np.arange(count) < 40, 0.05, 0.0)
    for turns, is_found in ((drift, False), (np.where(np.arange(count) < 40, 0.06, 0.0), True)):
        odometry = laser.copy()
        odometry[:, :2] = np.stack([0.2 * np.cos(turns), 0.2 * np.sin(turns)], axis=1)
        options = ViewChangeOptions()
        found = direction_change(laser, odometry, np.zeros(3), options.min_steps, options)
        assert found is not None
        assert found.exceeds(options.min_direction, options.sigmas) == is_found


def contradictions(log: LaserLog) -> list[str]:
    return checked_file(log, ReadingOptions(), FileCheckOptions()).messages


@pytest.mark.parametrize("name", REAL)
def test_nothing_is_contradicted_on_real_logs(name):
    """But for fr079's odometry, which never reverses though its robot does, and mit-killian's, whose turns
    are those of its scans .64 s later."""
    said = contradictions(read_log(str(data_file(f"{name}.log.gz"))))
    known = {
        "fr079": ["odometry counts reversing as driving forward"],
        "mit-killian": ["odometry is stamped 0.64 s too early, by the turns of the scans"],
    }
    assert [each.partition(":")[0].partition(";")[0] for each in said] == known.get(name, [])


def test_nothing_is_contradicted_on_a_log_from_the_field():
    assert contradictions(read_log(str(data_file("field/player-2.1.2.log")))) == []


def test_nothing_is_contradicted_on_samples():
    assert contradictions(read_log(OFFICE_LOG)) == []
    assert contradictions(read_log(CORRIDOR_LOG)) == []


def test_a_bare_corridor_tells_nothing():
    """Along it a match ends where it starts: no step is measured."""
    log = bare_corridor().record(1).log()
    assert contradictions(odometry_faults.scaled(log, 1000.0)) == []
    assert contradictions(log) == []


def test_a_robot_that_stands_contradicts_nothing():
    log = faults.taken(drive(), np.zeros(100, dtype=np.int64))
    assert contradictions(log) == []
