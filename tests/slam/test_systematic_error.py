"""A systematic error of odometry is seen in the map of the drive, and taken out."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import wrap
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions, SystematicErrorOptions
from nscan_cli.slam.systematic_error import (
    SystematicError,
    systematic_error,
    without_systematic_error,
)
from tests.benchmarks.laser_kinds import HARD, recorded
from tests.benchmarks.lasers import rms
from tests.simulation.scenes import office

OPTIONS = SystematicErrorOptions()
LEAST = OPTIONS.min_length


def winding(count: int = 2000, seed: int = 0) -> np.ndarray:
    """Poses (count, 3) of a robot that drives 5 cm from one to the next and turns smoothly."""
    draw = np.random.default_rng(seed)
    turns = np.convolve(draw.normal(0.0, 0.02, count), np.ones(20) / 20, "same")
    headings = np.cumsum(turns)
    middles = headings - 0.5 * turns
    steps = 0.05 * np.stack([np.cos(middles), np.sin(middles)], axis=1)
    return np.column_stack([np.cumsum(steps, axis=0), wrap(headings)])


@functools.cache
def any_log() -> LaserLog:
    return office().record(1).log()


def disturbed(poses: np.ndarray, length: float, turn: float) -> np.ndarray:
    """Odometry (n, 3) of these poses whose ways are `length` times as long and turn by `turn` more, rad/m."""
    log = dataclasses.replace(any_log(), odometry=poses, odometry_path=None)
    odometry = without_systematic_error(log, SystematicError(length, turn)).odometry
    assert odometry is not None
    return odometry


def error_of(poses: np.ndarray, odometry: np.ndarray, *breaks: int) -> SystematicError:
    """What is found, where something is."""
    found = systematic_error(poses, odometry, breaks, OPTIONS, LEAST)
    assert found is not None
    return found


@given(st.floats(0.8, 1.25), st.floats(-0.1, 0.1))
def test_an_error_and_its_opposite_leave_odometry_as_it_is(length, turn):
    poses = winding()
    back = disturbed(disturbed(poses, length, turn), 1.0 / length, -turn / length)
    np.testing.assert_allclose(back[:, :2], poses[:, :2], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(wrap(back[:, 2] - poses[:, 2]), 0.0, atol=1e-9)


@pytest.mark.parametrize(("length", "turn"), [(1.1, 0.09), (0.9, -0.05), (1.08, 0.0)])
def test_the_error_is_found_from_a_map_without_it(length, turn):
    poses = winding()
    odometry = disturbed(poses, length, turn)
    found = error_of(poses, odometry)
    assert found.length == pytest.approx(1.0 / length, abs=0.01)
    assert found.turn == pytest.approx(-turn / length, abs=0.002)


def test_ways_of_which_the_map_has_a_small_part_are_no_error_of_odometry():
    """As of scans that tell no way: then the map has hardly any."""
    poses = winding()
    assert systematic_error(poses, disturbed(poses, 2.0, 0.0), (), OPTIONS, LEAST) is None
    assert systematic_error(poses, disturbed(poses, 1.5, 0.0), (), OPTIONS, LEAST) is not None


def test_errors_that_are_small_or_differ_along_the_way_are_none():
    poses = winding()
    assert systematic_error(poses, disturbed(poses, 1.04, 0.1), (), OPTIONS, LEAST) is None
    assert systematic_error(poses, None, (), OPTIONS, LEAST) is None
    for known in (0, 1):
        missing = np.full_like(poses, np.nan)
        missing[:known] = poses[:known]
        assert systematic_error(poses, missing, (), OPTIONS, LEAST) is None
    # Half of the way is too long, and half of it too short by a little less.
    halves = [disturbed(poses[:1000], 1.3, 0.0), disturbed(poses[1000:], 0.8, 0.0)]
    assert systematic_error(poses, np.concatenate(halves), (), OPTIONS, LEAST) is None
    # The ranges changed half-way.
    halves = [disturbed(poses[:1000], 1.01, 0.0), disturbed(poses[1000:], 1.15, 0.0)]
    assert systematic_error(poses, np.concatenate(halves), (), OPTIONS, LEAST) is None


def test_too_few_pieces_tell_nothing_and_breaks_and_gaps_end_pieces():
    poses = winding()
    odometry = disturbed(poses, 1.1, 0.0)
    few = int(OPTIONS.min_pieces * OPTIONS.window / 0.05 / 1.1) - 10
    assert systematic_error(poses[:few], odometry[:few], (), OPTIONS, LEAST) is None
    assert systematic_error(poses, odometry, range(0, 2000, 60), OPTIONS, LEAST) is None
    moved = poses.copy()
    moved[1000:, 0] += 50.0
    assert error_of(moved, odometry, 1000).length == pytest.approx(0.909, abs=0.01)
    odometry[500:600] = np.nan
    assert error_of(poses, odometry).length == pytest.approx(0.909, abs=0.01)


def test_unknown_odometry_stays_unknown():
    poses = winding()
    poses[40:60] = np.nan
    corrected = disturbed(poses, 1.1, 0.01)
    assert np.array_equal(np.isnan(corrected), np.isnan(poses))


def test_bare_corridors_are_as_long_as_they_are_with_odometry_that_is_too_long():
    """Odometry 10 % too long, veering by 5° a metre. Measured: 0.037 m, 0.32 m as recorded."""
    log, truth = recorded(HARD[0], 2, "poor")
    drive = map_drive(log, SlamOptions())
    assert rms(drive.graph.poses, truth) < 0.1
    [said] = drive.messages
    assert all(
        part in said for part in ("too long", "a metre too far left", "--as-recorded", "--range-scale 1.09")
    )
    as_recorded = map_drive(log, SlamOptions(), reading=ReadingOptions(as_recorded=True))
    assert rms(as_recorded.graph.poses, truth) > 0.2
    assert as_recorded.messages == []


def test_jumps_of_odometry_are_no_error_of_all_of_it():
    """They make ways longer in each part of the drive, but most of each part is right."""
    poses = winding()
    odometry = poses.copy()
    for row in range(45, len(poses), 90):
        odometry[row:, :2] += 1.5 * np.array([np.cos(poses[row, 2]), np.sin(poses[row, 2])])
    assert systematic_error(poses, odometry, (), OPTIONS, LEAST) is None
    believed = dataclasses.replace(OPTIONS, short_window=OPTIONS.window)
    assert systematic_error(poses, odometry, (), believed, LEAST) is not None
