"""Poses in space, against what they are in the plane."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.recordings.decoded_messages import Pose3D
from nscan_cli.logs.recordings.poses_3d import as_matrix, heading, inverse_transform, planar_mount
from nscan_cli.poses import wrap
from tests.logs.recordings.messages import turned

ANGLES = st.floats(-3.1, 3.1)
METRES = st.floats(-10, 10)
POSES = st.tuples(METRES, METRES, ANGLES)


@given(POSES, st.floats(-0.3, 0.3), st.booleans())
def test_roll_is_the_tilt_whatever_the_yaw(pose, roll, hangs):
    matrix = as_matrix(Pose3D((pose[0], pose[1], 1.0), turned(pose[2], roll + (math.pi if hangs else 0.0))))
    assert matrix is not None
    mount, hanging, tilt = planar_mount(matrix)
    assert hanging == hangs
    assert tilt == pytest.approx(abs(roll), abs=1e-7)
    assert float(wrap(mount[2] - pose[2])) == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(inverse_transform(matrix) @ matrix, np.eye(4), atol=1e-9)


@given(ANGLES, st.floats(0.1, 10))
def test_heading_needs_no_unit_quaternion(yaw, scale):
    x, y, z, w = turned(yaw)
    found = heading(Pose3D((0, 0, 0), (scale * x, scale * y, scale * z, scale * w)))
    assert found is not None
    assert float(wrap(found - yaw)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "pose",
    [
        Pose3D((0, 0, 0), (0, 0, 0, 0)),
        Pose3D((math.nan, 0, 0), (0, 0, 0, 1)),
        Pose3D((0, 0, 0), (0, 0, math.nan, 1)),
    ],
)
def test_what_is_no_pose(pose):
    assert as_matrix(pose) is None
    assert heading(pose) is None
