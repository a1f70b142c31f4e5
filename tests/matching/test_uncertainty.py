from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.matching.pairwise import PairOptions
from nscan_cli.matching.uncertainty import covariance_of, covariances_of, decrement, weakest_translation

WEAK = PairOptions().weak_sigma


def test_covariance_is_the_inverse_or_nothing():
    information = np.array([[4.0, 1.0], [1.0, 9.0]])
    covariance = covariance_of(information)
    assert covariance is not None
    np.testing.assert_allclose(covariance, np.array([[9.0, -1.0], [-1.0, 4.0]]) / 35, rtol=1e-12)
    for hopeless in (np.zeros((3, 3)), np.diag([1.0, 0.0]), np.diag([1e9, 1e-4]), np.diag([1.0, -2.0])):
        assert covariance_of(hopeless) is None


def test_of_several_matrices_each_has_its_own_inverse_or_none():
    information = np.array([np.diag([4.0, 2.0]), np.diag([1.0, 0.0]), np.diag([8.0, 5.0])])
    first, none, last = covariances_of(information)
    assert first is not None
    assert none is None
    assert last is not None
    np.testing.assert_allclose(first, np.diag([0.25, 0.5]))
    np.testing.assert_allclose(last, np.diag([0.125, 0.2]))
    assert covariances_of(np.zeros((0, 3, 3))) == []


def test_decrement_counts_standard_deviations():
    """On the parabola ½ (x/σ)² with σ = 0.1, the minimum is 3 σ away at x = 0.3."""
    assert decrement(np.array([0.3 / 0.1**2]), np.array([[0.1**2]])) == pytest.approx(3.0)


@given(
    st.floats(-1.5, 1.57), st.floats(0.01, 1), st.floats(2, 100), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)
)
def test_the_weakest_direction_is_the_longest_axis_of_the_marginal_covariance(angle, weak, ratio, a, b):
    """Built from a covariance: whatever the rotation is, the longest axis of its translation is meant."""
    axis = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-axis[1], axis[0]])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = weak**2 * (np.outer(axis, axis) + np.outer(across, across) / ratio**2)
    # Any correlation with the rotation that keeps the whole positive definite.
    covariance[:2, 2] = covariance[2, :2] = weak * 0.1 * (a * axis + b * across / ratio)
    covariance[2, 2] = 0.01
    weakest = weakest_translation(np.linalg.inv(covariance).astype(np.float64), WEAK)
    assert weakest.sigma == pytest.approx(weak, rel=1e-6)
    off = (weakest.direction - angle + np.pi / 2) % np.pi - np.pi / 2
    assert abs(off) < 1e-6
    assert -np.pi / 2 < weakest.direction <= np.pi / 2


def test_weak_is_what_five_centimetres_do_not_hold():
    for sigma, weak in ((0.04, False), (0.06, True)):
        assert weakest_translation(np.diag([sigma**-2, 1e6, 1e6]), WEAK).is_weak == weak
    assert weakest_translation(np.diag([0.0, 1e6, 1e6]), WEAK).is_weak


def test_what_nothing_holds_has_no_deviation():
    assert weakest_translation(np.zeros((3, 3)), WEAK).sigma is None
    open_along_y = weakest_translation(np.diag([100.0, 0.0, 5.0]), WEAK)
    assert open_along_y.sigma is None
    assert abs(open_along_y.direction) == pytest.approx(np.pi / 2)
