"""Beams that seem to cover more or less than a turn, while walls go on from the last to the first."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import data_file
from tests.logs.noisy_room import BEAMS, FIRST, STEP, readings, recording
from tests.simulation.laser import Laser
from tests.simulation.scenes import office

SCANS = 200


def told(log) -> list[str]:
    return [said for said in log.report.contradictions if "as if it were one turn" in said]


@pytest.mark.parametrize("factor", [0.95, 0.98, 1.02, 1.05, 1.1])
def test_a_step_that_is_some_percent_off_is_that_of_a_turn(read, factor):
    log = read(recording(readings(SCANS), angle_min=FIRST * factor, step=STEP * factor))
    np.testing.assert_allclose(log.angle_increment, STEP)
    np.testing.assert_allclose(log.angle_min, FIRST, atol=0.2 * STEP)
    assert len(told(log)) == 1


def test_the_first_direction_stays_where_the_laser_does_not_look_ahead(read):
    log = read(recording(readings(SCANS, first=0.0), angle_min=0.0, step=STEP * 1.02))
    np.testing.assert_allclose(log.angle_min, 0.0)
    assert len(told(log)) == 1


@functools.cache
def drive(beams_a_turn: int) -> LaserLog:
    """A laser of 360 beams, so many of which would be a turn, 1 cm of noise."""
    laser = Laser(360, -math.pi, 2 * math.pi / beams_a_turn, 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))
    return office().record_at(office().truth()[:600], 4, laser).log()


@pytest.mark.parametrize("beams", [359, 361])
def test_one_beam_too_few_or_too_many_is_told_by_many_scans_together(tmp_path, beams):
    step = np.full(600, 2 * math.pi / beams)
    path = tmp_path / "v.log"
    path.write_bytes(with_own_angles(dataclasses.replace(drive(360), angle_increment=step)))
    log = read_log(str(path))
    np.testing.assert_allclose(log.angle_increment, math.radians(1.0))
    assert len(told(log)) == 1


@pytest.mark.parametrize("beams", [359, 361])
def test_a_laser_whose_ends_look_the_same_way_or_leave_a_gap_keeps_its_beams(tmp_path, beams):
    """Some drivers divide the turn so, and the data decide."""
    path = tmp_path / "v.log"
    path.write_bytes(with_own_angles(drive(beams)))
    log = read_log(str(path))
    np.testing.assert_allclose(log.angle_increment, 2 * math.pi / beams)
    assert not told(log)


def test_what_is_said_and_asked_for_stays(read):
    written = recording(readings(SCANS), step=STEP * 1.02)
    assert not told(read(written, as_recorded=True))
    chosen = read(written, angle_increment=STEP * 1.02)
    np.testing.assert_allclose(chosen.angle_increment, STEP * 1.02)
    assert not told(chosen)


def test_a_laser_with_a_gap_keeps_it(read):
    beams = BEAMS - 4
    log = read(recording(readings(SCANS, beams=beams)))
    np.testing.assert_allclose(log.angle_increment, STEP)
    assert not told(log)


def test_a_robot_that_stands_and_walls_farther_apart_tell_nothing(read):
    still = np.repeat(readings(1), SCANS, axis=0)
    assert not told(read(recording(still, step=STEP * 1.02)))
    nothing_behind = readings(SCANS)
    nothing_behind[:, :10] = math.inf
    assert not told(read(recording(nothing_behind, step=STEP * 1.02)))


@pytest.mark.parametrize("beams", [2, 5, 7])
def test_a_ring_of_a_few_beams_tells_nothing(read, beams):
    step = 1.02 * 2 * math.pi / beams
    assert not told(read(recording(readings(SCANS, beams=beams, step=step), step=step)))


@pytest.mark.logs
@pytest.mark.parametrize("name", ["mocap.bag", "rplidar-floor", "rplidar-hallway.bag", "varying-beams.db3"])
def test_no_real_laser_is_put_right(name):
    assert not told(read_log(str(data_file(f"field/{name}")), ReadingOptions()))
