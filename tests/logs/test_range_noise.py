"""Noise of ranges is named where it is large; rough walls are not noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.range_noise import noise_of_ranges
from tests.logs.noisy_room import STEP, Readings, readings

INCREMENTS = np.full(len(readings()), STEP)


def with_noise(sigma: float, seed: int = 1) -> Readings:
    noise = np.random.default_rng(seed).normal(0.0, sigma, readings().shape)
    noisy: Readings = (readings() + noise).astype(np.float32)
    return noisy


@given(st.floats(0.09, 0.3), st.integers(0, 100))
def test_its_standard_deviation_is_said(sigma, seed):
    said = noise_of_ranges(with_noise(sigma, seed), INCREMENTS)
    assert said.startswith("ranges of beams beside each other scatter by ")
    assert float(said.split(" by ")[1].split(" m")[0]) == pytest.approx(sigma, rel=0.15)


@pytest.mark.parametrize("sigma", [0.0, 0.02, 0.05])
def test_that_of_usual_lasers_is_not(sigma):
    assert noise_of_ranges(with_noise(sigma), INCREMENTS) == ""


def test_what_is_far_away_is_rough():
    assert noise_of_ranges(with_noise(0.1), INCREMENTS) != ""
    far = (readings() + 15.0 + np.random.default_rng(1).normal(0.0, 0.1, readings().shape)).astype(np.float32)
    assert noise_of_ranges(far, INCREMENTS) == ""


def test_a_straight_wall_has_no_noise_however_aslant():
    angles = np.radians(np.arange(-85.0, 86.0))
    ranges = np.repeat(2.0 / np.cos(angles)[None], 20, axis=0).astype(np.float32)
    assert noise_of_ranges(ranges, np.full(20, np.radians(1.0))) == ""


def test_too_few_ranges_and_none_tell_nothing():
    noisy = with_noise(0.2)
    assert noise_of_ranges(noisy[:1], INCREMENTS[:1]) == ""
    assert noise_of_ranges(noisy[:, :2], INCREMENTS) == ""
    assert noise_of_ranges(np.full_like(noisy, np.inf), INCREMENTS) == ""
    noisy[:, ::2] = np.nan
    assert noise_of_ranges(noisy, INCREMENTS) == ""
