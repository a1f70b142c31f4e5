from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.motion_model import MotionModel, Prior, odometry_prior, prior_value
from nscan_cli.poses import compose


def test_the_prior_is_the_odometry_step_with_deviations_that_grow_with_it():
    model = MotionModel(0.1, 0.2, 0.01, 0.3, 0.05)
    reference = np.array([5.0, -2.0, 3.0])
    step = np.array([3.0, -4.0, -0.5])
    prior = odometry_prior(reference, compose(reference, step), model)
    np.testing.assert_allclose(prior.mean, step, atol=1e-12)
    # 5 m driven and 0.5 rad turned: 0.1 + 0.2 · 5 m; 0.01 + 0.3 · 0.5 + 0.05 · 5 rad.
    np.testing.assert_allclose(prior.information, np.diag([1.1**-2, 1.1**-2, 0.41**-2]))


def test_a_turn_across_the_jump_is_a_small_turn():
    prior = odometry_prior(np.array([0, 0, 3.1]), np.array([0, 0, -3.1]), MotionModel())
    assert prior.mean[2] == pytest.approx(2 * np.pi - 6.2)
    assert prior.information[2, 2] == pytest.approx((0.05 + 0.2 * (2 * np.pi - 6.2)) ** -2)


def test_the_value_of_a_prior_is_half_the_square_of_the_difference_by_its_information():
    half = np.random.default_rng(3).normal(size=(3, 3))
    prior = Prior(np.array([1.0, -2.0, 3.0]), half @ half.T)
    off = np.array([0.4, -0.3, 0.5])
    pose = prior.mean + off
    expected = 0.5 * off @ prior.information @ off
    assert prior_value(prior, pose) == pytest.approx(expected)
    assert prior_value(prior, pose - [0.0, 0.0, 2 * np.pi]) == pytest.approx(expected)
