"""Beam angles, no-return values, range limits and mounting, each from numbers derived by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.laser_defaults import beam_angles, mark_no_returns, mount_from_poses, no_return_value
from nscan_cli.poses import compose


@pytest.mark.parametrize(
    ("beams", "first", "step", "last"),
    [
        (180, -90, 1, 89),
        (181, -90, 1, 90),
        (360, -90, 0.5, 89.5),
        (361, -90, 0.5, 90),
        # 400 beams of 0.25°: 399 steps, 99.75°, half of it to each side.
        (400, -49.875, 0.25, 49.875),
        (401, -50, 0.25, 50),
        (541, -90, 1 / 3, 90),
        (2, -90, 180, 90),
        (1, -90, 180, -90),
    ],
)
def test_beam_angles_follow_carmen(beams, first, step, last):
    angle_min, increment = beam_angles(beams)
    assert math.degrees(angle_min) == pytest.approx(first)
    assert math.degrees(increment) == pytest.approx(step)
    assert math.degrees(angle_min + (beams - 1) * increment) == pytest.approx(last)


def room(rng: np.random.Generator, readings: int = 20000, farthest: float = 20.0) -> np.ndarray:
    """Readings rounded to 1 cm, ever fewer towards the farthest, as a log's are."""
    return np.round(farthest * rng.random(readings) ** 2, 2).astype(np.float32)


@pytest.mark.parametrize("sentinel", [81.91, 81.83, 81.87, 50.0, 32.76, 30.0])
def test_no_return_is_the_peak_above_all_readings(sentinel):
    readings = room(np.random.default_rng(1))
    readings[::50] = sentinel
    assert no_return_value(readings) == pytest.approx(sentinel, abs=1e-3)


def test_no_return_that_is_spread_over_some_centimetres():
    readings = room(np.random.default_rng(2))
    readings[::50], readings[::1000], readings[:2] = 51.06, 51.11, 51.20
    assert no_return_value(readings) == pytest.approx(51.06, abs=1e-3)


def test_sick_codes_are_known_even_when_rare():
    assert no_return_value(np.array([1.0, 2.0, 81.83, 81.91], dtype=np.float32)) == pytest.approx(81.83)


def test_a_log_without_no_returns_has_none():
    assert no_return_value(room(np.random.default_rng(3))) is None


def test_a_wall_seen_all_the_time_is_no_sentinel():
    # The end wall of a corridor at 20 m with 1 cm of noise: no centimetre has half of its readings.
    rng = np.random.default_rng(4)
    readings = room(rng, farthest=15.0)
    readings[::10] = np.round(20 + 0.015 * rng.standard_normal(2000), 2)
    assert no_return_value(readings) is None


@pytest.mark.parametrize("readings", [[], [np.nan, 0.0], [1.0] * 500, [1.0, 2.0, 3.0] * 100])
def test_too_little_to_tell(readings):
    assert no_return_value(np.array(readings, dtype=np.float32)) is None


def test_marks():
    ranges = np.array([[-1, 0, np.nan, 0.5, 0.51, 7.99, 8.0, 81.91, np.inf]], dtype=np.float32)
    mark_no_returns(ranges, np.array([0.5]), np.array([8.0]))
    nan, inf = np.nan, np.inf
    expected = [[nan, nan, nan, nan, np.float32(0.51), np.float32(7.99), inf, inf, inf]]
    np.testing.assert_array_equal(ranges, np.array(expected, dtype=np.float32))


@pytest.mark.parametrize("mount", [(0.1, 0.02, 0.05), (-0.3, 0.0, math.pi), (0.0, 0.0, 0.0)])
def test_mount_is_the_pose_between_both(mount):
    rng = np.random.default_rng(5)
    robot = rng.normal(size=(51, 3)) * (30, 30, 2)
    laser = compose(robot, np.array(mount))
    laser[::10] += rng.normal(size=(6, 3))  # a minority of odd records does not move the median far
    laser[:, :2] = np.round(laser[:, :2], 6)
    found = mount_from_poses(laser, robot)
    np.testing.assert_allclose(found[:2], mount[:2], atol=2e-6)
    assert math.cos(found[2] - mount[2]) == pytest.approx(1, abs=1e-9)
