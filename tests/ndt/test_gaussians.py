"""Walls that are seen from both sides: two faces, in one cell."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.ndt.association import association_buffers, begin_association, update_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS, energy, evaluate_energy, inlier_share, sum_association
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose, relative, transform
from tests.ndt.transforms import assert_same, entries, gaussian_count, subtract

THICK = 0.12
"""m"""
SOUTH, NORTH = np.array([0.3, 0.0, 1.4]), np.array([-0.2, 4.1, -1.6])
"""Poses of a robot on either side of a wall along y = 2."""
FRAMES = [np.zeros(3), np.array([-3.1, 0.7, 0.5]), np.array([5.3, 2.2, 2.3])]
"""The wall along an axis of the grid, and not."""


def face(y: float, seed: int) -> Array:
    """(200, 2) points along a face of the wall, with noise of 5 mm."""
    rng = np.random.default_rng(seed)
    return np.stack([np.linspace(-2.45, 2.45, 200), y + 0.005 * rng.standard_normal(200)], axis=1)


def seen(points: Array, pose: Array) -> Array:
    """The points in the order in which beams of a robot at the pose hit them."""
    found = relative_points(points, pose)
    return found[np.argsort(np.arctan2(found[:, 1], found[:, 0]))]


def relative_points(points: Array, pose: Array) -> Array:
    """Points (m, 2) in the frame of a pose."""
    return transform(relative(np.zeros(3), pose), points)


def added(*faces: tuple[Array, Array], frame: Array = FRAMES[0], minimum: int = 5) -> Ndt:
    """The NDT of faces, each seen from a pose."""
    ndt = Ndt.empty(GaussianOptions(1.0, minimum), 16)
    for points, pose in faces:
        ndt.add(seen(points, pose), compose(frame, pose))
    return ndt


FRONT, BACK = (face(2.0, 1), SOUTH), (face(2.0 + THICK, 2), NORTH)


@pytest.mark.parametrize("frame", FRAMES, ids=["along", "half a radian", "backwards"])
@pytest.mark.parametrize("order", [(FRONT, BACK), (BACK, FRONT)], ids=["south first", "north first"])
def test_each_side_is_associated_with_its_own_face(frame, order):
    both = added(*order, frame=frame)
    for points, pose in order:
        alone, scan, at = added((points, pose), frame=frame), seen(points, pose), compose(frame, pose)
        for shift in np.zeros(3), np.array([0.02, -0.03, 0.01]):
            found, expected = energy(both, scan, at + shift), energy(alone, scan, at + shift)
            assert expected.value < -100
            assert found.value == pytest.approx(expected.value, rel=1e-9)
            np.testing.assert_allclose(found.gradient, expected.gradient, rtol=1e-6, atol=1e-6)
        assert inlier_share(both.grid, both.half, scan, at, 9.0) == inlier_share(
            alone.grid, alone.half, scan, at, 9.0
        )


def test_a_scan_is_not_pulled_into_the_wall():
    """One Gaussian of both faces has its mean in the middle: a scan would be off by half of THICK."""
    both, scan, pose = added(FRONT, BACK), seen(*FRONT), SOUTH.copy()
    for _ in range(10):
        found = energy(both, scan, pose, exact=False)
        pose -= np.linalg.solve(found.hessian + 1e-6 * np.eye(3), found.gradient)
    # The noise of 200 points, 5 mm / √200, and a little more for the four grids.
    assert abs(transform(pose, relative_points(np.array([[0.0, 2.0]]), SOUTH))[0, 1] - 2.0) < 0.001


@pytest.mark.parametrize("frame", FRAMES, ids=["along", "half a radian", "backwards"])
def test_the_means_lie_on_the_faces(frame):
    ndt = added(FRONT, BACK, frame=frame)
    fronts = ndt.grid.gaussians[: ndt.rows]
    two_faced = fronts[fronts[:, 7] > 0]
    assert len(two_faced) > 8
    for gaussian in two_faced:
        other = ndt.grid.gaussians[int(gaussian[7])]
        on = relative_points(np.array([gaussian[:2], other[:2]]), frame)[:, 1]
        # Five points at least: 5 mm / √5, three and a half times.
        np.testing.assert_allclose(np.sort(on), [2.0, 2.0 + THICK], atol=0.008)
        # Each shows the side that it was seen from.
        assert gaussian[5:7] @ other[5:7] < -0.99


def test_a_face_of_too_few_points_does_not_change_the_other():
    few = BACK[0][::12]
    # 17 points on 5 m: two to five in a block of 1 m.
    both, alone = added(FRONT, (few, NORTH), minimum=6), added(FRONT, minimum=6)
    scan = seen(*FRONT)
    assert energy(both, scan, SOUTH).value == pytest.approx(energy(alone, scan, SOUTH).value, rel=1e-9)
    assert energy(both, seen(few, NORTH), NORTH).value == 0.0


def test_a_wall_that_is_passed_by_has_one_face():
    """Ahead and behind, at a grazing angle, from the same side."""
    poses = [np.array([x, 1.2, turn]) for x in (-6.0, -3.0, 0.0, 3.0, 6.0) for turn in (0.0, 3.0)]
    ndt = added(*((face(2.0, seed), pose) for seed, pose in enumerate(poses)))
    assert gaussian_count(ndt) == len(entries(ndt)) > 10
    assert (ndt.grid.gaussians[: ndt.rows, 7] == 0.0).all()
    for gaussian in entries(ndt).values():
        np.testing.assert_allclose(gaussian[5:7], [0.0, -1.0], atol=0.01)


def test_a_face_is_subtracted_from_its_own():
    both = added(FRONT, BACK)
    subtract(both, seen(*BACK), BACK[1])
    assert_same(both, added(FRONT))
    both.add(seen(*BACK), BACK[1])
    assert_same(both, added(FRONT, BACK))
    subtract(both, seen(*FRONT), FRONT[1])
    scan = seen(*BACK)
    assert energy(both, scan, NORTH).value == pytest.approx(energy(added(BACK), scan, NORTH).value, rel=1e-9)
    assert energy(both, seen(*FRONT), SOUTH).value == 0.0
    subtract(both, seen(*BACK), BACK[1])
    assert gaussian_count(both) == 0


def test_growing_and_compacting_keep_both_faces():
    ndt = added(FRONT, BACK)
    scans = [(seen(*FRONT), SOUTH), (seen(*BACK), NORTH)]
    before = [energy(ndt, *scan).value for scan in scans]
    ndt.reserve(10 * len(ndt.grid.keys))
    assert [energy(ndt, *scan).value for scan in scans] == before
    ndt.add(np.array([[30.0, 30.0]]), np.zeros(3))
    assert [energy(ndt, *scan).value for scan in scans] == before
    ends, at = np.cumsum([0, *(len(points) for points, _ in scans)]), np.array([pose for _, pose in scans])
    points = np.concatenate([points for points, _ in scans])
    compact = Ndt.of_scans(points, ends, at, GaussianOptions(1.0, 5), capacity=16)
    assert [energy(compact, *scan).value for scan in scans] == before


@pytest.mark.parametrize(("points", "pose"), [FRONT, BACK], ids=["south", "north"])
def test_an_updated_association_has_the_right_face(points, pose):
    ndt, scan = added(FRONT, BACK), seen(points, pose)
    association, kept, anew = begin_association(scan), np.empty(ENERGY_NUMBERS), np.empty(ENERGY_NUMBERS)
    rng = np.random.default_rng(3)
    for _ in range(30):
        at = pose + rng.uniform(-0.1, 0.1, 3)
        update_association(ndt.grid, ndt.half, association, at)
        sum_association(association, 0.3, 0.0, kept)
        buffers = association_buffers(len(scan), 1)
        evaluate_energy(ndt.grid, ndt.half, scan, at, 0.3, 0.0, 0.0, 1, buffers, anew)
        assert anew[0] < -10
        np.testing.assert_allclose(kept, anew, rtol=1e-9, atol=1e-9 * np.abs(anew).max())
