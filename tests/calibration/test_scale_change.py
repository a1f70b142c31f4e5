"""A change of scale along steps is found, with the place and its standard deviation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.mount_fit import fit_mount
from nscan_cli.calibration.odometry_options import ScaleChangeOptions
from nscan_cli.calibration.scale_change import scale_change
from nscan_cli.poses import Array, compose, relative

OPTIONS = ScaleChangeOptions()
EXACT = np.full(200, 1e-3)
MOUNT = np.array([0.3, -0.1, 0.7])


def steps(factor: float, at: int, noise: float, seed: int, count: int = 60) -> tuple[Array, Array]:
    """Steps (n, 3) of laser and odometry, whose lengths are wrong from one step on."""
    rng = np.random.default_rng(seed)
    robot = np.stack([rng.uniform(0.1, 0.3, count), np.zeros(count), rng.normal(0.0, 0.2, count)], axis=1)
    laser = relative(compose(robot, MOUNT), MOUNT)
    odometry = robot.copy()
    odometry[:, 0] *= 1.0 + noise * rng.standard_normal(count)
    odometry[at:, :2] /= factor
    return laser, odometry


@pytest.mark.parametrize(("factor", "at"), [(1.15, 30), (0.85, 20), (2.0, 45)])
def test_the_place_and_both_scales_are_found(factor, at):
    laser, odometry = steps(factor, at, 0.03, 1)
    fit = fit_mount(laser, odometry, 0.3)
    assert fit is not None
    found = scale_change(laser, odometry, EXACT[: len(laser)], fit, OPTIONS)
    assert found is not None
    assert abs(found.step - at) <= 2
    assert found.before == pytest.approx(1.0, abs=0.02)
    assert found.behind == pytest.approx(factor, rel=0.03)
    assert found.exceeds(OPTIONS.min_factor, OPTIONS.sigmas)


def test_noise_is_no_change():
    for seed in range(200):
        laser, odometry = steps(1.0, 30, 0.06, seed)
        fit = fit_mount(laser, odometry, 0.3)
        assert fit is not None
        found = scale_change(laser, odometry, EXACT[: len(laser)], fit, OPTIONS)
        assert found is not None
        assert not found.exceeds(OPTIONS.min_factor, OPTIONS.sigmas)


def test_few_steps_tell_none():
    laser, odometry = steps(1.2, 8, 0.0, 1, count=15)
    fit = fit_mount(laser, odometry, 0.3)
    assert fit is not None
    assert scale_change(laser, odometry, EXACT[: len(laser)], fit, OPTIONS) is None
    assert scale_change(laser, odometry, EXACT[: len(laser)], fit, replace(OPTIONS, min_steps=7)) is not None


def test_steps_whose_lengths_scans_hardly_tell_are_no_change():
    laser, odometry = steps(0.7, 40, 0.0, 1)
    fit = fit_mount(laser, odometry, 0.3)
    assert fit is not None
    sigmas = np.where(np.arange(60) < 40, 1e-3, 0.1)
    found = scale_change(laser, odometry, sigmas, fit, OPTIONS)
    assert found is None or not found.exceeds(OPTIONS.min_factor, OPTIONS.sigmas)
