"""Poses between poses."""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.poses import wrap


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


def test_outside_the_ends_hold_and_are_told():
    warnings: list[str] = []
    found = interpolated_poses(
        np.array([0.0, 1.5, 9.0]),
        np.array([1.0, 2.0]),
        np.array([[1.0, 0, 0], [2, 0, 0]]),
        "record",
        warnings,
    )
    assert found is not None
    np.testing.assert_allclose(found[:, 0], [1, 1.5, 2])
    assert warnings == ["2 scans before the first record or after the last: that one's pose is used"]


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
