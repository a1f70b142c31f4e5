"""Driving and odometry: limits are kept, errors are as large as said."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import relative, wrap
from tests.simulation.drive import Drive, Odometry, odometry, poses

SQUARE = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.5)])
PERFECT = Odometry(0.0, 0.0, 0.0, 1.0, 0.0)


def generator(seed: int = 7) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def test_every_way_point_is_reached_within_the_limits():
    drive = Drive()
    path = poses(SQUARE, drive)
    for goal in SQUARE:
        assert np.hypot(*(path[:, :2] - goal).T).min() <= drive.reach
    steps = np.diff(path, axis=0)
    assert np.hypot(steps[:, 0], steps[:, 1]).max() <= drive.speed * drive.period + 1e-9
    assert np.abs(wrap(steps[:, 2])).max() <= drive.turn_rate * drive.period + 1e-9


def test_perfect_odometry_is_the_truth():
    truth = poses(SQUARE, Drive())
    found = odometry(truth, PERFECT, generator())
    np.testing.assert_allclose(found, relative(truth, truth[0]), atol=1e-9)


def test_bias_adds_up():
    # 10 m straight on: 1 % too long, and 0.1° a metre makes 1°.
    truth = np.stack([np.linspace(0, 10, 101), np.zeros(101), np.zeros(101)], axis=-1)
    found = odometry(truth, Odometry(0.0, 0.0, 0.0, 1.01, np.radians(0.1)), generator())
    assert np.degrees(found[-1, 2]) == pytest.approx(1.0)
    assert np.hypot(*np.diff(found[:, :2], axis=0).T).sum() == pytest.approx(10.1)


def test_noise_grows_with_the_root_of_the_way_whatever_the_steps():
    for count in (26, 101):
        truth = np.stack([np.linspace(0, 25, count), np.zeros(count), np.zeros(count)], axis=-1)
        errors = Odometry(0.01, np.radians(0.25), 0.0, 1.0, 0.0)
        ends = np.array([odometry(truth, errors, generator(seed))[-1] for seed in range(300)])
        # √25 = 5 times the error of one metre.
        assert np.degrees(ends[:, 2].std()) == pytest.approx(5 * 0.25, rel=0.15)
        assert ends[:, 0].std() == pytest.approx(5 * 0.01, rel=0.25)
