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
    as_before = replace(CHECKS, longest_ratio=np.inf, top_speed=np.inf)
    assert len(without_jumps(odometry, clock(150), as_before)[1]) == 0


def test_counters_that_wrap_round_in_a_tenth_of_the_steps_of_a_fast_robot_go_on():
    """2 m in 0.1 s are ten times what is usual: fewer than twenty times, but faster than a robot is."""
    odometry = steady(step=0.2)
    odometry[:, 0] = np.mod(odometry[:, 0] + 0.1, 2.0)
    _, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert jumps.tolist() == list(range(10, 150, 10))
    slower = 10.0 * clock(150)
    assert len(without_jumps(odometry, slower, CHECKS)[1]) == 0


def test_a_shorter_jump_among_long_ones_is_one():
    """Two long jumps in 120 steps are the usual longest step, and a tenth of one passes for usual."""
    odometry = steady()
    for row, way in ((20, 30.0), (60, 1.5), (100, 30.0)):
        odometry[row:, 1] += way
    _, jumps = without_jumps(odometry, clock(150), CHECKS)
    assert jumps.tolist() == [20, 60, 100]


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
