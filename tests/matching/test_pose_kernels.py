from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.matching.pose_kernels import composed_pose, relative_pose, wrapped
from nscan_cli.poses import compose, relative, wrap

numbers = st.floats(-100, 100)
poses = st.tuples(numbers, numbers, st.floats(-10, 10)).map(np.array)


@settings(deadline=None)
@given(poses, poses)
def test_the_kernels_say_what_the_functions_for_arrays_say(a, b):
    out = np.empty(3)
    for kernel, function in ((relative_pose, relative), (composed_pose, compose)):
        kernel(a, b, out)
        expected = function(a, b)
        np.testing.assert_allclose(out[:2], expected[:2], atol=1e-10)
        # At ±π either may be the other side of it.
        assert abs(wrap(out[2] - expected[2])) < 1e-10


def test_a_pose_may_be_composed_in_place():
    """Golden: 2 m ahead of (1, 2) looking along y, turned by 0.5 rad more."""
    pose = np.array([1.0, 2.0, np.pi / 2])
    composed_pose(pose, np.array([2.0, 0.0, 0.5]), pose)
    np.testing.assert_allclose(pose, [1.0, 4.0, np.pi / 2 + 0.5], atol=1e-12)


@given(st.floats(-1e3, 1e3))
def test_angles_are_wrapped_as_everywhere(angle):
    assert wrapped(angle) == pytest.approx(float(wrap(angle)), abs=1e-12)
    assert -np.pi <= wrapped(angle) <= np.pi
