from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nscan_cli.poses import (
    Array,
    compose,
    inverse,
    path_lengths,
    relative,
    relative_jacobians,
    rotated_information,
    transform,
    wrap,
)
from tests.ndt.differences import derivative

lengths = st.floats(-100, 100, allow_subnormal=False)
angles = st.floats(-10, 10, allow_subnormal=False)
poses = st.builds(lambda x, y, a: np.array([x, y, a]), lengths, lengths, angles)


def assert_same_pose(a: Array, b: Array) -> None:
    np.testing.assert_allclose(a[:2], b[:2], atol=1e-9)
    assert abs(float(wrap(a[2] - b[2]))) < 1e-9


@given(st.floats(-1e6, 1e6))
def test_wrap_keeps_the_direction_within_its_range(angle):
    wrapped = float(wrap(angle))
    assert -math.pi < wrapped <= math.pi
    turns = (angle - wrapped) / (2 * math.pi)
    assert abs(turns - round(turns)) < 1e-9


def test_wrap_at_the_ends_of_its_range():
    assert float(wrap(math.pi)) == math.pi
    assert float(wrap(-math.pi)) == math.pi
    assert float(wrap(3 * math.pi)) == math.pi
    np.testing.assert_allclose(wrap([0.0, 2 * math.pi, -7.0]), [0.0, 0.0, 2 * math.pi - 7.0], atol=1e-15)


@given(poses, poses)
def test_relative_undoes_compose(a, b):
    assert_same_pose(relative(compose(a, b), a), b)
    assert_same_pose(compose(a, relative(b, a)), b)


@given(poses, poses, poses)
def test_compose_is_associative(a, b, c):
    assert_same_pose(compose(compose(a, b), c), compose(a, compose(b, c)))


@given(poses, poses)
def test_inverse(a, b):
    assert_same_pose(compose(a, inverse(a)), np.zeros(3))
    assert_same_pose(compose(inverse(a), a), np.zeros(3))
    assert_same_pose(inverse(relative(a, b)), relative(b, a))


@given(poses, poses, poses)
def test_a_global_motion_leaves_relative_poses(motion, a, b):
    assert_same_pose(relative(compose(motion, a), compose(motion, b)), relative(a, b))


@given(poses, poses, arrays(np.float64, (5, 2), elements=lengths))
def test_composing_poses_composes_their_mappings(a, b, points):
    np.testing.assert_allclose(
        transform(compose(a, b), points), transform(a, transform(b, points)), atol=1e-9
    )


def test_eq_2_by_hand():
    """From (1, 2, 90°) the place (1, 5) is 3 m straight ahead, and (0, 2) 1 m to the left."""
    frame = np.array([1.0, 2.0, math.pi / 2])
    seen = relative([[1.0, 5.0, math.pi], [0.0, 2.0, 0.0]], frame)
    np.testing.assert_allclose(seen, [[3.0, 0.0, math.pi / 2], [0.0, 1.0, -math.pi / 2]], atol=1e-15)


def test_the_path_begins_at_the_first_pose_and_turns_are_no_way():
    path = np.array([[1.0, 1.0, 0.0], [4.0, 5.0, 0.0], [4.0, 5.0, 3.0], [4.0, 3.0, 3.0]])
    assert path_lengths(path).tolist() == [0.0, 5.0, 5.0, 7.0]
    assert path_lengths(path[:1]).tolist() == [0.0]


def test_leading_axes_broadcast():
    rng = np.random.default_rng(0)
    many, one = rng.uniform(-3, 3, (4, 5, 3)), rng.uniform(-3, 3, 3)
    for function in (compose, relative):
        together = function(many, one)
        assert together.shape == (4, 5, 3)
        np.testing.assert_allclose(together[2, 3], function(many[2, 3], one))


@given(poses, poses)
def test_jacobians_are_the_derivatives(a, b):
    # Around ±π the angle jumps; the derivative is meant without the jump.
    def unwrapped(both: Array) -> Array:
        return np.append(relative(both[:3], both[3:])[:2], both[2] - both[5])

    steps = np.full(6, 1e-3)
    by_differences = derivative(unwrapped, lambda _: 0, np.concatenate([a, b]), steps)
    assert by_differences is not None
    by_a, by_b = relative_jacobians(a, b)
    np.testing.assert_allclose(np.hstack([by_a, by_b]), by_differences.T, atol=1e-7)


@given(poses, arrays(np.float64, (3,), elements=st.floats(-1, 1)))
def test_rotated_information_keeps_the_quadratic_form(pose, offset):
    information = np.diag([4.0, 100.0, 9.0])
    information[0, 2] = information[2, 0] = 1.5
    turned = np.append(transform([0, 0, pose[2]], offset[:2]), offset[2])
    rotated = rotated_information(pose, information)
    np.testing.assert_allclose(turned @ rotated @ turned, offset @ information @ offset, atol=1e-9)
