"""The noise of odometry, learned from pieces of the path along which scans tell their place."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import Array, compose
from nscan_cli.slam.frontend.odometry_noise import (
    SAMPLES,
    OdometryNoise,
    OdometryNoiseOptions,
    learn_noise,
    learned_shares,
)

OPTIONS = OdometryNoiseOptions()
TELLING, BLIND = np.diag([1e4, 1e4, 1e4]), np.diag([1e4, 1.0, 1e4])
"""Hessians of a scan that tells its place, and of one in a bare corridor."""
STEP = 0.2


def learned(sigma: float, hessian: Array = TELLING, n: int = 2000, gap: int = 0) -> OdometryNoise:
    """After n steps of 0.2 m straight on; odometry walks off by `sigma` (m, rad) for the root of a metre."""
    rng, noise = np.random.default_rng(1), OdometryNoise.begin()
    pose, odometry = np.zeros(3), np.zeros(3)
    for k in range(n):
        pose = compose(pose, np.array([STEP, 0.0, 0.0]))
        odometry = compose(odometry, np.array([STEP, 0.0, 0.0]) + sigma * np.sqrt(STEP) * rng.normal(size=3))
        length = np.nan if gap and k % gap == 0 else STEP
        learn_noise(noise, OPTIONS, pose, odometry, length, hessian, 625.0)
    return noise


@pytest.mark.parametrize("sigma", [0.003, 0.01, 0.03])
def test_a_random_walk_is_learned(sigma):
    """Across the way an error of the angle counts too: a third of the variance times the piece's length²."""
    noise = learned(sigma)
    assert np.sqrt(noise.variances[1]) == pytest.approx(sigma, rel=0.3)
    drift = 1 + 0.5 * OPTIONS.window**2 / 3
    assert np.sqrt(noise.variances[0]) == pytest.approx(sigma * np.sqrt(drift), rel=0.35)


def test_nothing_is_learned_where_scans_tell_little_or_odometry_is_missing():
    assert learned(0.01, BLIND).counts[SAMPLES] == 0
    assert learned(0.01, gap=5).counts[SAMPLES] == 0
    assert learned(0.01).counts[SAMPLES] > 50


def test_shares_grow_with_the_noise_and_never_widen_a_prior():
    shares = [learned_shares(learned(sigma), OPTIONS, STEP, 0.06, 0.07) for sigma in (1e-5, 0.003, 0.01, 1.0)]
    along = [share[0] for share in shares]
    assert along == sorted(along)
    assert along[0] == OPTIONS.min_share
    assert along[-1] == 1.0
    few = learned(0.01, n=40)
    assert few.counts[SAMPLES] < OPTIONS.min_pieces
    assert learned_shares(few, OPTIONS, STEP, 0.06, 0.07) == (1.0, 1.0)
