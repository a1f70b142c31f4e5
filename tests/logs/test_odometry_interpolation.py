"""Poses between poses."""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.logs.odometry_interpolation import interpolated_poses, moved_odometry
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, wrap


def test_linear_in_place_and_by_the_shorter_turn():
    at = np.array([10.0, 11.0, 13.0])
    poses = np.array([[0, 0, 3.0], [1, 2, -3.0], [3, 2, -2.0]])
    warnings: list[str] = []
    found = interpolated_poses(np.array([10.0, 10.5, 12.0, 13.0]), at, poses, "record", warnings)
    assert found is not None
    # From 3 to −3 rad over π: 0.283 rad further, half of that at 10.5 s.
    half = float(wrap(3.0 + (2 * math.pi - 6.0) / 2))
    expected = np.array([[0, 0, 3], [0.5, 1, half], [2, 2, -2.5], [3, 2, -2]])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert warnings == []


def at_every_tenth(poses: Array, times: list[float], warnings: list[str]) -> Array | None:
    """Interpolated at `times` from poses every 0.1 s, except where they are nan."""
    at = np.arange(len(poses)) / 10
    kept = ~np.isnan(poses[:, 0])
    return interpolated_poses(np.asarray(times), at[kept], poses[kept], "pose", warnings)


def driven(poses: int, speed: float = 0.5) -> Array:
    """A straight drive with so many poses, 0.1 s apart; speed in m/s."""
    return np.stack([np.arange(poses) * speed / 10, np.zeros(poses), np.zeros(poses)], axis=1)


def test_beyond_the_ends_it_is_missing_and_told():
    """Within a period the nearest pose holds: a recorder rarely gets both topics at once."""
    warnings: list[str] = []
    found = at_every_tenth(driven(21), [-1.0, -0.05, 1.0, 2.05, 3.0, 4.0], warnings)
    assert found is not None
    np.testing.assert_allclose(found[:, 0], [np.nan, 0.0, 0.5, 1.0, np.nan, np.nan])
    (warning,) = warnings
    assert warning.startswith("odometry is missing at 3 scans (")
    assert warning.endswith(
        "no pose near scan 0, scans 4 to 5; the robot is assumed to keep its velocity there"
    )


def test_a_gap_in_which_the_robot_moved_is_no_straight_line():
    poses, warnings = driven(100), list[str]()
    poses[20:60] = np.nan
    found = at_every_tenth(poses, [1.0, 1.9, 1.98, 3.0, 5.5, 5.95, 6.0], warnings)
    assert found is not None
    # Near a pose, that one holds.
    np.testing.assert_allclose(found[:, 0], [0.5, 0.95, 0.95, np.nan, np.nan, 3.0, 3.0])
    assert len(warnings) == 1


def test_a_short_gap_is_interpolated():
    poses, warnings = driven(100), list[str]()
    poses[20:27] = np.nan
    found = at_every_tenth(poses, [2.5], warnings)
    assert found is not None
    np.testing.assert_allclose(found[0, 0], 1.25)
    assert not warnings


def test_a_robot_that_stands_need_not_say_so():
    """Some drivers send poses only while the wheels turn."""
    poses, warnings = driven(100, speed=0.0), list[str]()
    poses[20:60] = np.nan
    found = at_every_tenth(poses, [4.0], warnings)
    assert found is not None
    assert np.isfinite(found).all()
    assert not warnings


def test_none_inside_is_no_odometry():
    warnings: list[str] = []
    assert (
        interpolated_poses(np.array([5.0, 6.0]), np.array([1.0, 2.0]), np.zeros((2, 3)), "record", warnings)
        is None
    )
    assert warnings == [
        "no scan lies between the first record (1.000 s) and the last (2.000 s): "
        "the scans go from 5.000 s to 6.000 s; no odometry"
    ]


def test_scans_that_come_to_lie_in_a_gap_have_no_odometry():
    """As if it led on from before the gap, they would be elsewhere, and it would jump after them."""
    poses = driven(100)
    poses[60:] += [2.0, 5.0, 1.5]
    kept = np.r_[:20, 60:100]
    path, times = robot_path(kept / 10, poses[kept]), np.array([1.5, 1.9, 6.0, 6.1, 6.5])
    assert path is not None
    found = moved_odometry(np.full(5, True), path, times - 0.15)
    at = np.array([13.5, 17.5, np.nan, 60.0, 63.5])
    expected = np.stack([0.05 * at, 0.0 * at, 0.0 * at], axis=1)
    expected[3:] += [2.0, 5.0, 1.5]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_scans_without_odometry_have_none_at_other_times():
    path = robot_path(np.arange(10) / 10, driven(10))
    assert path is not None
    found = moved_odometry(np.array([True, False]), path, np.array([0.25, 0.35]))
    np.testing.assert_allclose(found[:, 0], [0.125, np.nan])
