"""Odometry that stands still for some scans and makes up for it in one step."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.frontend.odometry_checks import OdometryCheckOptions
from nscan_cli.slam.frontend.odometry_stalls import without_stalls
from tests.data import data_file
from tests.logs.excerpts import truth_of
from tests.simulation.faults import taken
from tests.slam.frontend.test_tracker import SOUTH, end_off
from tests.slam.mapped_logs import mapped, office_log

STALLS = OdometryCheckOptions().stalls._replace(min_named=0.0)
PERIOD = 0.2
"""s"""


def driven(steps: Array) -> tuple[Array, Array]:
    """Poses (S, 3) of a robot that makes these steps (S − 1, 3), and the times of them."""
    poses = [np.zeros(3)]
    for step in steps:
        poses.append(compose(poses[-1], step))
    times = np.linspace(0.0, PERIOD * (len(poses) - 1), len(poses))
    return np.array(poses), times


def held(odometry: Array, row: int, count: int) -> Array:
    """Odometry (S, 3) that still says the pose of a row in the `count` rows after it."""
    stalled = odometry.copy()
    stalled[row + 1 : row + count + 1] = odometry[row]
    return stalled


@settings(deadline=None)
@given(st.integers(2, 8), st.integers(2, 12), st.floats(0.05, 0.3), st.floats(-0.3, 0.3))
def test_what_steady_motion_would_have_said_takes_the_place_of_a_stall(count, row, step, turn):
    poses, times = driven(np.tile([step, 0.0, turn], (24, 1)))
    evened, ends = without_stalls(held(poses, row, count), times, STALLS)
    np.testing.assert_array_equal(ends, [row + count + 1])
    known = np.setdiff1d(np.arange(25), np.arange(row + 1, row + count + 1))
    np.testing.assert_array_equal(evened[known], poses[known])
    # The chord in place of the arc: no pose is farther off than the arc is from its chord, 1/8 κ s².
    length = step * (count + 1)
    assert np.hypot(*(evened - poses)[:, :2].T).max() < 1e-9 + length * abs(turn) * (count + 1) / 4
    np.testing.assert_allclose(np.unwrap(evened[:, 2]), np.unwrap(poses[:, 2]), atol=1e-9)


@settings(deadline=None)
@given(st.lists(st.floats(0.0, 0.3), min_size=4, max_size=30), st.integers(0, 6))
def test_a_robot_that_stops_and_starts_again_has_no_stall(speeds, rest):
    """It takes a step or more to get to its speed again."""
    half = sorted(speeds)
    steps = np.zeros((2 * len(half) + rest, 3))
    steps[:, 0] = [*half[::-1], *np.zeros(rest), *half]
    poses, times = driven(steps)
    evened, ends = without_stalls(poses, times, STALLS)
    assert len(ends) == 0
    np.testing.assert_array_equal(evened, poses)


def test_a_jump_after_a_rest_is_no_stall():
    """No robot goes as far in the time."""
    steps = np.tile([0.1, 0.0, 0.0], (12, 1))
    steps[4:7], steps[7] = 0.0, [5.0, 0.0, 0.0]
    poses, times = driven(steps)
    assert len(without_stalls(poses, times, STALLS)[1]) == 0


def test_scans_that_are_far_apart_see_a_robot_that_stops_and_goes():
    """In 0.6 s a robot may brake and catch up; fr079 with every third scan was 2 m wrong there."""
    steps = np.tile([0.3, 0.0, 0.0], (24, 1))
    steps[10:12, 0] = 0.1, 0.5
    poses, times = driven(steps)
    assert len(without_stalls(poses, 3.0 * times, STALLS)[1]) == 0
    assert without_stalls(poses, 0.5 * times, STALLS)[1].tolist() == [12]


def test_where_scans_come_unevenly_odometry_is_believed():
    """A scan that was logged late has its own odometry."""
    poses, times = driven(np.tile([0.3, 0.0, 0.0], (24, 1)))
    times[10] += 0.7 * PERIOD
    wrong = poses.copy()
    wrong[15] = poses[15] + (0.2, 0.0, 0.0)
    evened, ends = without_stalls(wrong, times, STALLS)
    np.testing.assert_allclose(evened, poses, atol=1e-9)
    assert ends.tolist() == [16]


def test_only_large_corrections_are_named():
    poses, times = driven(np.tile([0.1, 0.0, 0.0], (24, 1)))
    stalled = held(held(poses, 3, 2), 12, 5)
    evened, ends = without_stalls(stalled, times, STALLS._replace(min_named=0.3))
    np.testing.assert_allclose(evened, poses, atol=1e-9)
    assert ends.tolist() == [18]


def stalled_corridor() -> LaserLog:
    """22 m of corridor at 0.3 m a scan, with odometry that stands for four scans, twice."""
    log = taken(office_log(), np.arange(SOUTH.start, SOUTH.stop, 3))
    assert log.odometry is not None
    return dataclasses.replace(log, odometry=held(held(log.odometry, 20, 4), 40, 4))


def test_tracking_goes_on_over_a_stall():
    """Along a corridor a scan fits where it stands, and then where it jumps to: 0.75 m off and more."""
    log = stalled_corridor()
    track = np.concatenate(mapped(log).state.tracked)
    steps = relative(relative(track[1:], track[:-1]), relative(truth_of(log)[1:], truth_of(log)[:-1]))
    assert np.abs(steps[:, :2]).max() < 0.05
    assert np.abs(end_off(track, truth_of(log)))[:2].max() < 0.05


@pytest.mark.parametrize("every", [1, 2, 3])
def test_a_stall_of_mit_csail_breaks_nothing(every):
    """Its odometry stands for 0.8 s of a fast turn; every second scan alone was a break there."""
    log = read_log(str(data_file("mit-csail.log.gz")))
    part = taken(log, np.arange(240, 420, every))
    assert mapped(part).state.breaks == []


@settings(deadline=None)
@given(
    st.integers(2, 20),
    st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=3),
    st.floats(0.2, 0.5),
    st.floats(-0.1, 0.1),
)
def test_poses_with_wrong_stamps_on_a_steady_way_are_where_they_would_be(row, late, step, turn):
    """Poses of up to three scans are those of up to a scan before or after them."""
    poses, times = driven(np.tile([step, 0.0, turn], (28, 1)))
    wrong = poses.copy()
    for k, share in enumerate(late, row + 1):
        wrong[k] = compose(poses[k], share * np.array([step, 0.0, turn]))
    evened, ends = without_stalls(wrong, times, STALLS)
    off = np.hypot(*(evened - poses)[:, :2].T).max()
    recorded = np.hypot(*(wrong - poses)[:, :2].T).max()
    assert off <= recorded + 1e-9
    steep = 2.1 * abs(late[0]) * step > 1.1 * STALLS.min_acceleration * PERIOD**2
    if len(late) == 1 and steep and abs(late[0]) * step > 1.1 * STALLS.min_motion and abs(late[0]) > 0.6:
        assert ends.tolist() == [row + 2]
        assert off < 0.05 * step


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 0.6), st.floats(-0.4, 0.4)), min_size=4, max_size=40))
@example([(0.0, 0.375), (0.4375, 0.0), (0.0, 0.0), (0.5, 0.25), (0.4375, 0.0), (0.25, 0.125)])
def test_the_direction_of_time_does_not_matter(steps):
    poses, times = driven(np.array([[step, 0.0, turn] for step, turn in steps]))
    evened, ends = without_stalls(poses, times, STALLS)
    backwards, starts = without_stalls(poses[::-1], -times[::-1], STALLS)
    assert len(ends) == len(starts)
    assert np.abs(backwards[::-1] - evened).max() < 0.1


def test_a_stall_backwards_in_time_is_evened_out():
    poses, times = driven(np.tile([0.3, 0.0, 0.02], (24, 1)))
    stalled = held(poses, 8, 5)
    forward, _ = without_stalls(stalled, times, STALLS)
    backward, starts = without_stalls(stalled[::-1], -times[::-1], STALLS)
    np.testing.assert_allclose(backward[::-1], forward, atol=1e-9)
    assert starts.tolist() == [24 - 8]


@settings(deadline=None)
@given(st.lists(st.floats(0.05, 0.5), min_size=6, max_size=30), st.floats(-0.5, 0.5))
def test_a_robot_that_changes_its_speed_is_believed(speeds, turn):
    """Its speed rises and falls, once."""
    steps = np.zeros((2 * len(speeds), 3))
    steps[:, 0] = [*sorted(speeds), *sorted(speeds, reverse=True)]
    steps[:, 2] = turn * steps[:, 0]
    poses, times = driven(steps)
    evened, ends = without_stalls(poses, times, STALLS)
    assert len(ends) == 0
    np.testing.assert_array_equal(evened, poses)


def test_poses_that_share_a_stamp_stay_as_they_are():
    """They have no speed, and their mean was a division by zero."""
    poses, times = driven(np.tile([0.1, 0.0, 0.0], (40, 1)))
    times[10:25] = times[10]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        evened, ends = without_stalls(poses, times, STALLS)
    np.testing.assert_array_equal(evened, poses)
    assert len(ends) == 0
