"""Transforms in space against those in the plane, and chains of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.recordings.decoded_messages import FramePose, Rigid
from nscan_cli.logs.recordings.moving_mount import at_rest, links
from nscan_cli.logs.recordings.tf_chains import (
    Frames,
    as_matrix,
    heading,
    inverse_transform,
    planar,
    unmoved,
    way,
)
from nscan_cli.poses import Array, compose, wrap
from tests.logs.recordings.drives import turned

ANGLES = st.floats(-3.1, 3.1)
METRES = st.floats(-10, 10)
POSES = st.tuples(METRES, METRES, ANGLES)


def chain(frames: Frames, start: str, end: str) -> tuple[list[str], Array] | None:
    """The frames on the way, and the last one in the first."""
    names = way(frames.fixed, start, end)
    return None if names is None else (names, at_rest(links(names, frames.fixed, {})))


def level(pose: tuple[float, float, float]) -> Rigid:
    return Rigid((pose[0], pose[1], 0.7), turned(yaw=pose[2]))


@given(st.lists(POSES, min_size=1, max_size=5))
def test_a_level_chain_is_that_of_the_plane(poses):
    frames = Frames()
    expected = np.zeros(3)
    for k, pose in enumerate(poses):
        assert frames.add(FramePose(0, f"f{k}", f"f{k + 1}", level(pose)))
        expected = compose(expected, np.array(pose))
    found = chain(frames, "f0", f"f{len(poses)}")
    assert found is not None
    names, matrix = found
    assert names == [f"f{k}" for k in range(len(poses) + 1)]
    mount, hanging, tilt = planar(matrix)
    np.testing.assert_allclose(mount[:2], expected[:2], atol=1e-6)
    assert float(wrap(mount[2] - expected[2])) == pytest.approx(0, abs=1e-6)
    assert not hanging
    assert tilt < 1e-6
    back = chain(frames, f"f{len(poses)}", "f0")
    assert back is not None
    np.testing.assert_allclose(back[1] @ matrix, np.eye(4), atol=1e-9)


@given(POSES, st.floats(-0.3, 0.3), st.booleans())
def test_roll_is_the_tilt_whatever_the_yaw(pose, roll, hangs):
    matrix = as_matrix(Rigid((pose[0], pose[1], 1.0), turned(pose[2], roll + (math.pi if hangs else 0.0))))
    assert matrix is not None
    mount, hanging, tilt = planar(matrix)
    assert hanging == hangs
    assert tilt == pytest.approx(abs(roll), abs=1e-7)
    assert float(wrap(mount[2] - pose[2])) == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(inverse_transform(matrix) @ matrix, np.eye(4), atol=1e-9)


@given(ANGLES, st.floats(0.1, 10))
def test_heading_needs_no_unit_quaternion(yaw, scale):
    x, y, z, w = turned(yaw)
    found = heading(Rigid((0, 0, 0), (scale * x, scale * y, scale * z, scale * w)))
    assert found is not None
    assert float(wrap(found - yaw)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "pose",
    [
        Rigid((0, 0, 0), (0, 0, 0, 0)),
        Rigid((math.nan, 0, 0), (0, 0, 0, 1)),
        Rigid((0, 0, 0), (0, 0, math.nan, 1)),
    ],
)
def test_what_is_no_pose(pose):
    assert as_matrix(pose) is None
    assert heading(pose) is None
    assert not Frames().add(FramePose(0, "a", "b", pose))


def test_the_shortest_way_and_none():
    frames = Frames()
    for parent, child in (("a", "b"), ("b", "c"), ("a", "c"), ("x", "y")):
        frames.add(FramePose(0, parent, child, level((1, 0, 0))))
    found = chain(frames, "a", "c")
    assert found is not None
    assert found[0] == ["a", "c"]
    assert chain(frames, "a", "y") is None
    assert chain(frames, "a", "nowhere") is None


def test_unmoved():
    still, moving = level((1, 2, 0.5)), level((1, 2, 0.6))
    rows = [FramePose(k, "a", "b", still) for k in range(3)]
    rows += [FramePose(0, "b", "c", still), FramePose(1, "b", "c", moving), FramePose(2, "b", "c", still)]
    assert [(placed.parent, placed.child) for placed in unmoved(rows)] == [("a", "b")]
