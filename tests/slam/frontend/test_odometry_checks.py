"""Odometry that jumps and lasers that hang: what is believed of a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.poses import Array, relative
from nscan_cli.slam.frontend.odometry_checks import OdometryCheckOptions, frozen_scans, without_jumps
from tests.simulation import faults
from tests.slam.keyframe_drives import round_scene

CHECKS = OdometryCheckOptions()


def clock(scans: int) -> Array:
    return 0.1 * np.arange(scans, dtype=np.float64)


def steady(scans: int = 150, step: float = 0.1) -> Array:
    return np.stack([step * np.arange(scans), np.zeros(scans), np.full(scans, 0.3)], axis=1)


def test_odometry_without_jumps_is_left_alone():
    odometry = steady()
    believed, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert believed is odometry
    assert len(jumps) == 0
    # Two scans, or one, say nothing of what is usual.
    for few in (1, 2):
        assert len(without_jumps(odometry[:few], clock(few), CHECKS)[1]) == 0


def test_a_reset_goes_on_as_in_the_step_before():
    odometry = steady()
    odometry[20:] = relative(odometry[20:], odometry[20])
    believed, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert jumps.tolist() == [20]
    np.testing.assert_allclose(
        relative(believed[1:], believed[:-1]),
        np.tile(relative(steady()[1], steady()[0]), (149, 1)),
        atol=1e-9,
    )


def test_counters_that_wrap_round_often_go_on():
    """The robot drives along the place where they do, so that one step in thirty is a jump."""
    odometry = steady()
    odometry[:, 0] = np.mod(odometry[:, 0], 3.0)
    believed, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert jumps.tolist() == [30, 60, 90, 120]
    np.testing.assert_allclose(believed[-1], relative(steady()[-1], np.zeros(3)), atol=1e-9)


def test_counters_that_wrap_round_in_a_tenth_of_the_steps_of_a_fast_robot_go_on():
    odometry = steady(step=0.2)
    odometry[:, 0] = np.mod(odometry[:, 0] + 0.1, 2.0)
    _, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert jumps.tolist() == list(range(10, 150, 10))


def test_a_shorter_jump_among_long_ones_is_one():
    """Two long jumps in 120 steps are the usual longest step, and a tenth of one passes for usual."""
    odometry = steady()
    for row, way in ((20, 30.0), (60, 1.5), (100, 30.0)):
        odometry[row:, 1] += way
    _, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert jumps.tolist() == [20, 60, 100]


def test_short_jumps_in_more_than_one_of_a_hundred_steps_are_found():
    """They are the 99 % quantile of the steps, but no robot goes so far in a single step."""
    odometry = steady(300)
    for row in range(45, 300, 90):
        odometry[row:, 1] += 1.6
    _, jumps = without_jumps(odometry, clock(300), CHECKS)
    assert jumps.tolist() == [45, 135, 225]


def test_odometry_slower_than_the_scans_does_not_jump():
    """1.2 m in every tenth step are the usual step, though each stands alone."""
    odometry = steady(300, step=0.12)[np.arange(300) // 10 * 10]
    assert len(without_jumps(odometry, clock(300), CHECKS)[1]) == 0


def test_a_pause_in_which_the_robot_drove_on_is_believed():
    """2 m from scan to scan where 0.1 m are usual: 2 s of scans are missing."""
    rows = np.delete(np.arange(150), np.arange(20, 39))
    _, jumps = without_jumps(steady()[rows], clock(150)[rows], CHECKS)
    assert len(jumps) == 0
    _, jumps = without_jumps(steady()[rows], clock(len(rows)), CHECKS)
    assert jumps.tolist() == [20]


def test_a_laser_hangs_only_if_the_robot_moves():
    log = round_scene().record(5).log()
    moves = faults.frozen(log, slice(40, 45))
    assert frozen_scans(moves, moves.odometry, CHECKS).tolist() == list(range(40, 45))
    assert frozen_scans(moves, None, CHECKS).tolist() == []
    assert moves.odometry is not None
    stands = np.repeat(moves.odometry[:1], len(moves), axis=0)
    assert frozen_scans(moves, stands, CHECKS).tolist() == []
    # Where nothing is met, nothing repeats.
    assert frozen_scans(faults.without_returns(log, slice(40, 45)), moves.odometry, CHECKS).tolist() == []
    # A few returns are the same by chance.
    few = np.full_like(moves.ranges, np.inf)
    few[:, :4] = 2.0
    assert frozen_scans(replace(moves, ranges=few), moves.odometry, CHECKS).tolist() == []
