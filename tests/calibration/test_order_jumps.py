"""Readings that come in the other order from a scan on are put into one, and it is said."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.compared_ranges import compare_ranges
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.order_jumps import checked_order, order_jumps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.simulation import faults, odometry_faults
from tests.simulation.laser import Laser
from tests.simulation.scenes import office
from tests.slam.keyframe_drives import round_scene

OPTIONS = FileCheckOptions()
ROUND = Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))


@functools.cache
def drive() -> LaserLog:
    return round_scene().record(5).log()


def jumps_of(log: LaserLog) -> list[int]:
    return order_jumps(log, compare_ranges(log, OPTIONS), OPTIONS)


def checked(log: LaserLog) -> tuple[LaserLog, list[str]]:
    return checked_order(log, compare_ranges(log, OPTIONS), OPTIONS)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_the_wrong_part_is_read_in_the_order_of_the_others(share):
    """Odometry tells which part is wrong, however long it is."""
    log = drive()
    at = int(share * len(log))
    right, said = checked(faults.mirrored_in(log, slice(at, None)))
    assert len(said) == 1
    assert said[0].startswith(f"the readings of scans {at} to {len(log) - 1} come in the other order")
    for scan in (0, at - 1, at, len(log) - 1):
        off = right.points(scan)[:, None] - log.points(scan)[None]
        assert np.hypot(*off.T).min(axis=0).max() < 1e-6


def test_without_odometry_the_shorter_part_is_read_otherwise():
    log = replace(drive(), odometry=None)
    at = len(log) // 4
    _, said = checked(faults.mirrored_in(log, slice(at, None)))
    assert said[0].startswith(f"the readings of scans 0 to {at - 1} come in the other order")


def test_there_and_back_again():
    log = drive()
    at = len(log) // 3
    _, said = checked(faults.mirrored_in(log, slice(at, 2 * at)))
    assert said[0].startswith(f"the readings of scans {at} to {2 * at - 1} come in the other order")


def test_a_laser_that_is_turned_round_on_the_robot_is_no_change_of_the_order():
    """In a corridor half a turn and a mirror image look alike."""
    scene = office()
    log = scene.record_at(scene.truth()[250:850], 11, ROUND).log()
    assert jumps_of(faults.turned_in(log, np.pi, slice(200, 400))) == []
    assert jumps_of(faults.mirrored_in(log, slice(200, 400))) == [200, 400]


def test_what_is_wrong_all_along_or_with_odometry_is_no_change():
    for log in (faults.mirrored(drive()), odometry_faults.turning(drive(), -1.0), drive()):
        assert checked(log)[1] == []


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"])
def test_no_real_log_changes(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert jumps_of(log) == []


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail"])
def test_it_is_found_in_a_real_log(name):
    log = read_log(str(data_file(f"{name}.log.gz")))
    at = 4 * len(log) // 5
    assert jumps_of(faults.mirrored_in(log, slice(at, None))) == [at]


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-csail"])
def test_large_turns_from_scan_to_scan_are_no_change_without_odometry(name):
    """Every third scan of intel turns by up to 42°. In a long room, four matches of two turned scans prefer
    the mirror image; their steps contradict each other."""
    log = read_log(str(data_file(f"{name}.log.gz")), ReadingOptions(every=3, odometry=False))
    assert jumps_of(log) == []
