from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.ndt.energy import energy, inlier_share
from nscan_cli.ndt.hash_grid import find_row, pack_key
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import relative, transform
from tests.ndt import reference_ndt
from tests.ndt.transforms import assert_same, entries, gaussian_count, subtract
from tests.ndt.wall_points import room

HERE = np.zeros(3)
ELSEWHERE = np.array([-7.3, 4.1, 2.2])
PROBE = np.array([0.1, -0.05, 0.04])


def grown(points, cell=1.0, minimum=3, floor=0.02, capacity=512, pose=HERE) -> Ndt:
    ndt = Ndt.empty(GaussianOptions(cell, minimum, floor), capacity)
    ndt.add(points, pose)
    return ndt


@pytest.mark.parametrize(("cell", "minimum", "floor"), [(1.0, 3, 0.02), (0.5, 5, 0.02), (2.0, 4, 0.1)])
def test_gaussians_are_mean_and_covariance_of_the_points_in_each_cell(cell, minimum, floor):
    points = transform(ELSEWHERE, room(1))
    ndt = grown(points, cell, minimum, floor)
    expected = reference_ndt.gaussians(points, cell, minimum, floor)
    assert len(expected) > 30
    assert gaussian_count(ndt) == len(expected)
    sided = 0
    for (sx, sy, ix, iy), (mean, inverse, side) in expected.items():
        row = find_row(ndt.grid, pack_key(2 * ix + sx, 2 * iy + sy))
        assert row >= 0
        found = ndt.grid.gaussians[row]
        np.testing.assert_allclose(found[:2], mean, rtol=1e-12)
        scale = np.abs(inverse).max()
        np.testing.assert_allclose(found[2:5], inverse[np.triu_indices(2)], rtol=1e-8, atol=1e-8 * scale)
        values = np.linalg.eigvalsh(inverse)
        if values[0] < 0.9 * values[1]:
            # A round one has no normal.
            np.testing.assert_allclose(found[5:7], side, atol=1e-6)
            sided += bool(side.any())
    assert sided > 20


def test_a_straight_wall_is_held_across_and_hardly_along():
    """Points on the line y = 0.2, x from 0.1 to 0.9: variance along 0.8²/12 · (1 + 2/(n−1))."""
    x = np.linspace(0.1, 0.9, 17)
    ndt = grown(np.stack([x, np.full(17, 0.2)], axis=1))
    gaussian = entries(ndt)[int(pack_key(0, 0))]
    along = np.var(x)
    assert along == pytest.approx(0.8**2 / 12 * (1 + 2 / 16))
    # The floor of 0.02 m across; along, the inverse variance times the square of the ratio of the two.
    # Seen from the origin, its side is the one below.
    expected = np.array([0.5, 0.2, 0.02**4 / along**3, 0.0, 0.02**-2, 0.0, -1.0, 0.0])
    np.testing.assert_allclose(np.array(gaussian), expected, atol=1e-9)


def test_adding_moves_by_the_pose():
    moved, there = entries(grown(room(1), pose=ELSEWHERE)), entries(grown(transform(ELSEWHERE, room(1))))
    assert moved.keys() == there.keys()
    for key, gaussian in moved.items():
        # All but the side: it is that of the pose, or of the origin.
        np.testing.assert_allclose(gaussian[:5], there[key][:5], rtol=1e-9, atol=1e-9)


def test_a_wall_is_associated_from_the_side_that_it_was_seen_from():
    """A wall at y = 2 seen from the origin: a robot beyond it sees the other face, at the same place."""
    x = np.linspace(-1.5, 1.5, 61)
    wall = np.stack([x, np.full(61, 2.0)], axis=1)
    ndt = grown(wall, cell=1.0)
    ahead, beyond = np.array([0.4, -1.0, 0.2]), np.array([0.1, 5.0, 0.3])
    near, far = (transform(relative(HERE, pose), wall) for pose in (ahead, beyond))
    assert energy(ndt, near, ahead).value < -61
    assert energy(ndt, far, beyond).value == 0.0
    assert inlier_share(ndt.grid, ndt.half, far, beyond, 9.0) == 0.0
    # Once it was seen from both sides, it is met from both.
    ndt.add(far, beyond)
    assert energy(ndt, near, ahead).value < -61
    assert energy(ndt, far, beyond).value < -61


def test_growing_in_two_steps_is_growing_in_one():
    points = room(2)
    ndt = grown(points[::2])
    ndt.add(points[1::2], HERE)
    assert_same(ndt, grown(points))
    np.testing.assert_allclose(ndt.grid.sums[: ndt.rows, :, 0].sum(), len(points))


def test_subtracting_takes_back_what_was_added():
    base, more = room(3), room(4)
    ndt = grown(base)
    before = entries(ndt)
    ndt.add(more, ELSEWHERE)
    ndt.add(more, PROBE)
    assert entries(ndt).keys() != before.keys()
    subtract(ndt, more, ELSEWHERE)
    subtract(ndt, more, PROBE)
    assert_same(ndt, grown(base))
    subtract(ndt, base, HERE)
    assert gaussian_count(ndt) == 0
    assert energy(ndt, base, HERE).value == 0.0


def test_capacity_grows_with_the_points():
    points = np.concatenate([transform(pose, room(5)) for pose in np.arange(30).reshape(10, 3) - 15.0])
    small, large = Ndt.empty(GaussianOptions(1.0, 3), capacity=16), grown(points, capacity=1 << 14)
    for part in np.array_split(points, 50):
        small.add(part, HERE)
    assert len(small.grid.keys) > 500
    assert_same(small, large)
    # No key may be lost or doubled when the table is made anew.
    keys = small.grid.keys[: small.rows]
    assert len(np.unique(keys)) == small.rows
    assert [find_row(small.grid, key) for key in keys] == list(range(small.rows))


def test_compacting_keeps_the_energy_in_less_memory():
    points = room(6)
    large = grown(points, capacity=4096)
    compact = Ndt.of_scans(
        points, np.array([0, len(points)]), HERE[None], GaussianOptions(1.0, 3), capacity=4096
    )
    before, after = energy(large, room(7), PROBE), energy(compact, room(7), PROBE)
    assert after.value == before.value
    np.testing.assert_array_equal(after.hessian, before.hessian)
    assert sum(part.nbytes for part in compact.grid) < sum(part.nbytes for part in large.grid) / 2


def test_scans_taken_together_are_as_if_added_one_by_one():
    """With any initial capacity: a full grid is copied into a larger one."""
    scans = [room(seed) for seed in range(12)]
    poses = np.array([[3.0 * k, 0.5 * k, 0.1 * k] for k in range(12)])
    grown_by_each = Ndt.empty(GaussianOptions(0.5, 3), capacity=16)
    for points, pose in zip(scans, poses, strict=True):
        grown_by_each.add(points, pose)
    ends = np.cumsum([0, *map(len, scans)])
    for capacity in (16, 1 << 15):
        together = Ndt.of_scans(np.concatenate(scans), ends, poses, GaussianOptions(0.5, 3), capacity)
        assert together.rows == len(together.grid.keys) < grown_by_each.rows
        assert gaussian_count(together) == gaussian_count(grown_by_each)
        for points, pose in zip(scans, poses, strict=True):
            expected, found = (energy(ndt, points, pose + PROBE) for ndt in (grown_by_each, together))
            assert found.value == pytest.approx(expected.value, rel=1e-12)
            np.testing.assert_allclose(found.hessian, expected.hessian, rtol=1e-9, atol=1e-6)


def test_an_ndt_without_points_has_no_gaussians():
    ndt = grown(np.empty((0, 2)))
    assert gaussian_count(ndt) == 0
    assert energy(ndt, room(1), HERE).value == 0.0


def test_a_map_that_moves_drops_empty_cells():
    """It has the same bits as a map with capacity for all cells that it ever had."""
    small, large = (
        Ndt.empty(GaussianOptions(0.5, 3), capacity=16),
        Ndt.empty(GaussianOptions(0.5, 3), capacity=1 << 17),
    )
    poses = [np.array([3.0 * k, 0.5 * k, 0.1 * k]) for k in range(40)]
    sizes = []
    for k, pose in enumerate(poses):
        for ndt in (small, large):
            ndt.add(room(k), pose)
            if k >= 3:
                subtract(ndt, room(k - 3), poses[k - 3])
        assert energy(small, room(k), pose + 0.01).value == energy(large, room(k), pose + 0.01).value < -10.0
        sizes.append(len(small.grid.keys))
    assert gaussian_count(small) == gaussian_count(large)
    assert sizes[-1] == sizes[10] < large.rows // 2
