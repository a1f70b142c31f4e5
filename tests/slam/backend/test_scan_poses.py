"""The poses of all scans from those of the keyframes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.poses import Array, compose, relative, wrap
from nscan_cli.slam.backend.options import OptimisationOptions
from nscan_cli.slam.backend.scan_poses import between_keyframes

KEYFRAMES = np.array([0, 7, 12, 25, 26])
SCANS = 31
"""The last four come after the last keyframe."""


def driven(seed: int = 1) -> Array:
    """(SCANS, 3) tracked poses with turns beyond ±π."""
    rng = np.random.default_rng(seed)
    poses = np.zeros((SCANS, 3))
    for k in range(1, SCANS):
        poses[k] = compose(poses[k - 1], rng.normal([0.2, 0, 0.3], [0.05, 0.02, 0.3]))
    return poses


def shaken(poses: Array, seed: int) -> Array:
    """Poses as a graph might have corrected them."""
    rng = np.random.default_rng(seed)
    moved = poses + rng.normal(0, [0.3, 0.3, 0.2], poses.shape)
    moved[:, 2] = wrap(moved[:, 2])
    return moved


def assert_poses(found: Array, wanted: Array) -> None:
    np.testing.assert_allclose(found[..., :2], wanted[..., :2], atol=1e-9)
    np.testing.assert_allclose(wrap(found[..., 2] - wanted[..., 2]), 0, atol=1e-9)


def test_keyframes_get_exactly_their_poses():
    tracked = driven()
    poses = shaken(tracked[KEYFRAMES], 2)
    assert_poses(between_keyframes(tracked, KEYFRAMES, poses)[KEYFRAMES], poses)


def test_unchanged_keyframes_leave_the_tracked_poses():
    tracked = driven()
    assert_poses(between_keyframes(tracked, KEYFRAMES, tracked[KEYFRAMES]), tracked)


@given(
    st.integers(0, 10**6),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1)),
)
@settings(max_examples=50, deadline=None)
def test_when_the_keyframes_move_rigidly_all_scans_do(seed, motion):
    tracked = driven(seed)
    poses = shaken(tracked[KEYFRAMES], seed)
    before = between_keyframes(tracked, KEYFRAMES, poses)
    after = between_keyframes(tracked, KEYFRAMES, compose(np.array(motion), poses))
    assert_poses(after, compose(np.array(motion), before))


def test_scans_after_the_last_keyframe_move_rigidly_with_it():
    tracked = driven()
    found = between_keyframes(tracked, KEYFRAMES, shaken(tracked[KEYFRAMES], 3))
    assert_poses(relative(found[27:], found[26]), relative(tracked[27:], tracked[26]))


def test_a_correction_is_spread_by_the_way():
    """Golden: 1 m each from 0 to 4, but 2 m from 1 to 2; the keyframe at the end moves 1 m aside."""
    tracked = np.zeros((4, 3))
    tracked[:, 0] = [0, 1, 3, 4]
    poses = np.array([[0.0, 0, 0], [4.0, 1, 0]])
    found = between_keyframes(tracked, np.array([0, 3]), poses)
    wanted = np.array([[0.0, 0, 0], [1, 0.25, 0], [3, 0.75, 0], [4, 1, 0]])
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_a_turn_on_the_spot_wears_tracking_too():
    """Half a radian, then as much way as that is worth: the scan between has half of the correction."""
    tracked = np.array([[0.0, 0, 0], [0.0, 0, 0.5], [0.0, 0, 0.5]])
    tracked[2, :2] = 0.5 * OptimisationOptions.metres_per_radian * np.array([np.cos(0.5), np.sin(0.5)])
    poses = tracked[[0, 2]] + np.array([[0, 0, 0], [0.2, 0, 0]])
    found = between_keyframes(tracked, np.array([0, 2]), poses)
    np.testing.assert_allclose(found[1], [0.1, 0, 0.5], atol=1e-12)


def test_headings_on_both_sides_of_pi_are_near_each_other():
    """Corrections that leave one keyframe at π − 0.1 and the next at −π + 0.1: between them is π, not 0."""
    tracked = np.zeros((5, 3))
    tracked[:, 0] = np.arange(5)
    poses = np.array([[0.0, 0, np.pi - 0.1], [-4.0, 0, -np.pi + 0.1]])
    found = between_keyframes(tracked, np.array([0, 4]), poses)
    np.testing.assert_allclose(wrap(found[:, 2] - np.pi), [-0.1, -0.05, 0, 0.05, 0.1], atol=1e-12)
    assert (found[:, 2] > -np.pi).all()
    assert (found[:, 2] <= np.pi).all()


def test_a_robot_that_stands_still_stays_with_the_keyframe_before():
    tracked = np.zeros((4, 3))
    poses = np.array([[1.0, 2, 0.5], [3.0, 2, 0.5]])
    found = between_keyframes(tracked, np.array([0, 3]), poses)
    np.testing.assert_allclose(found, poses[[0, 0, 0, 1]])


def test_one_keyframe_carries_all():
    tracked, motion = driven(), np.array([3.0, -4, 2.5])
    assert_poses(between_keyframes(tracked, np.array([0]), motion[None]), compose(motion, tracked))
