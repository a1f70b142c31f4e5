"""Chains of transforms in space against those in the plane, and which transforms are fixed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.logs.recordings.decoded_messages import Pose3D, StampedTransform
from nscan_cli.logs.recordings.poses_3d import as_matrix, planar_mount
from nscan_cli.logs.recordings.tf_chains import FramePair, chain_links, composed, shortest_chain
from nscan_cli.logs.recordings.tf_tree import constant_transforms
from nscan_cli.poses import Array, compose, wrap
from tests.logs.recordings.messages import turned
from tests.logs.recordings.test_poses_3d import POSES


def level(x: float, y: float, yaw: float) -> Pose3D:
    return Pose3D((x, y, 0.7), turned(yaw=yaw))


def matrix_of(pose: Pose3D) -> Array:
    matrix = as_matrix(pose)
    assert matrix is not None
    return matrix


def chain(fixed: dict[FramePair, Array], start: str, end: str) -> tuple[list[str], Array] | None:
    """The frames of the chain, and the pose of the last one in the first."""
    frames = shortest_chain(fixed, start, end)
    return None if frames is None else (frames, composed(chain_links(frames, fixed, {}))[0])


@given(st.lists(POSES, min_size=1, max_size=5))
def test_a_level_chain_is_that_of_the_plane(poses):
    fixed = {}
    expected = np.zeros(3)
    for k, pose in enumerate(poses):
        fixed[f"f{k}", f"f{k + 1}"] = matrix_of(level(*pose))
        expected = compose(expected, np.array(pose))
    found = chain(fixed, "f0", f"f{len(poses)}")
    assert found is not None
    frames, matrix = found
    assert frames == [f"f{k}" for k in range(len(poses) + 1)]
    mount, hanging, tilt = planar_mount(matrix)
    np.testing.assert_allclose(mount[:2], expected[:2], atol=1e-6)
    assert float(wrap(mount[2] - expected[2])) == pytest.approx(0, abs=1e-6)
    assert not hanging
    assert tilt < 1e-6
    back = chain(fixed, f"f{len(poses)}", "f0")
    assert back is not None
    np.testing.assert_allclose(back[1] @ matrix, np.eye(4), atol=1e-9)


def test_the_shortest_chain_and_none():
    pairs = (("a", "b"), ("b", "c"), ("a", "c"), ("x", "y"))
    assert shortest_chain(pairs, "a", "c") == ["a", "c"]
    assert shortest_chain(pairs, "a", "y") is None
    assert shortest_chain(pairs, "a", "nowhere") is None


def test_constant_transforms():
    still, moving = level(1, 2, 0.5), level(1, 2, 0.6)
    rows = [StampedTransform(k, "a", "b", still) for k in range(3)]
    rows += [StampedTransform(k, "b", "c", pose) for k, pose in enumerate((still, moving, still))]
    assert [(one.parent, one.child) for one in constant_transforms(rows)] == [("a", "b")]
