"""Mounting and scale from steps that are known exactly, or nearly."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.calibration.mount_fit import fit_mount, fit_turns
from nscan_cli.poses import Array, compose, relative

MOUNT = np.array([0.21, -0.05, 1.3])


def steps(seed: int, noise: float = 0.0, scale: float = 1.0) -> tuple[Array, Array]:
    """80 steps of a laser at MOUNT, and of its robot whose odometry is `scale` times too short."""
    rng = np.random.default_rng(seed)
    robot = np.stack([rng.uniform(0, 0.3, 80), np.zeros(80), rng.uniform(-0.4, 0.4, 80)], axis=1)
    laser = relative(compose(robot, MOUNT), MOUNT)
    told = robot * (1 / scale, 1 / scale, 1.0) + noise * rng.normal(size=robot.shape)
    return laser, told


@pytest.mark.parametrize("scale", [1.0, 0.001, 30.0])
def test_exact_steps_give_the_mounting_and_the_scale(scale):
    fit = fit_mount(*steps(1, scale=scale), metres_per_radian=0.3)
    assert fit is not None
    np.testing.assert_allclose([fit.scale / scale, *fit.mount], [1, *MOUNT], atol=1e-6)
    assert fit.spread < 1e-6


def test_the_errors_are_as_large_as_said():
    """Normalised squared errors of 100 fits: 4 degrees of freedom."""
    squares = []
    for seed in range(100):
        fit = fit_mount(*steps(seed, noise=0.01), metres_per_radian=0.3)
        assert fit is not None
        off = np.array([fit.scale - 1, *(fit.mount - MOUNT)])
        squares.append(off @ np.linalg.solve(fit.covariance, off))
    assert 2.0 < np.mean(squares) < 7.0


def test_a_robot_that_never_turns_leaves_the_place_open():
    laser = np.tile([0.2, 0.0, 0.0], (30, 1))
    fit = fit_mount(laser, laser, metres_per_radian=0.3)
    assert fit is not None
    assert np.isinf(fit.sigmas).all()


def test_turns():
    laser, told = steps(2, noise=0.001)
    fit = fit_turns(laser, told * (1, 1, -0.6), min_turn=0.05)
    assert fit is not None
    assert fit.ratio == pytest.approx(-0.6, abs=0.01)
    assert fit.spread < 0.05
    assert fit.steps == np.count_nonzero(np.abs(laser[:, 2]) >= 0.05)
    assert fit_turns(laser * (1, 1, 0), told, min_turn=0.05) is None
