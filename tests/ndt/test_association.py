from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.ndt.association import (
    association_buffers,
    begin_association,
    count_inliers,
    update_association,
)
from nscan_cli.ndt.energy import ENERGY_NUMBERS, evaluate_energy, inlier_share, sum_association
from nscan_cli.ndt.grid_growth import change_points, make_all_gaussians
from nscan_cli.ndt.hash_grid import OUTDATED
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from tests.ndt.wall_points import room


def outside_in(count: int) -> Ndt:
    """An NDT whose walls are seen from one side, as a robot in the middle does."""
    ndt = Ndt.empty(GaussianOptions(0.5, 3))
    for seed in range(count):
        ndt.add(room(seed), np.array([0.02 * seed, 0.0, 0.01 * seed]))
    return ndt


@pytest.mark.parametrize("curvature", [0.0, 1.0])
@pytest.mark.parametrize("step", [1e-3, 0.05, 1.0, 30.0])
def test_an_updated_association_equals_a_new_look_up(step, curvature):
    ndt, points = outside_in(3), room(7)
    association, kept, anew = begin_association(points), np.empty(ENERGY_NUMBERS), np.empty(ENERGY_NUMBERS)
    rng, start = np.random.default_rng(5), np.array([0.1, -0.1, 0.05])
    counted = 0
    for n in range(40):
        # Every other time back where something is met.
        pose = start + (n % 2) * step * rng.uniform(-1, 1, 3)
        update_association(ndt.grid, ndt.half, association, pose)
        sum_association(association, 0.3, curvature, kept)
        buffers = association_buffers(len(points), 1)
        evaluate_energy(ndt.grid, ndt.half, points, pose, 0.3, curvature, 0.0, 1, buffers, anew)
        np.testing.assert_allclose(kept, anew, rtol=1e-9, atol=1e-9 * np.abs(anew).max())
        counted += anew[0] < -1.0
    assert counted >= 20


def test_inliers_of_an_association_are_those_of_a_new_look_up():
    ndt, points = outside_in(3), room(7)
    rng, counts = np.random.default_rng(6), set()
    for _ in range(20):
        pose = rng.uniform(-0.3, 0.3, 3)
        association = begin_association(points)
        update_association(ndt.grid, ndt.half, association, pose)
        counts.add(count_inliers(association, 9.0))
        assert count_inliers(association, 9.0) / len(points) == inlier_share(
            ndt.grid, ndt.half, points, pose, 9.0
        )
    assert len(counts) > 10


def test_outdated_gaussians_are_made_when_they_are_looked_up():
    at_once, later = outside_in(3), outside_in(3)
    for scan, pose, sign in ((room(5), np.array([0.1, 0.0, 0.02]), 1.0), (room(0), np.zeros(3), -1.0)):
        for ndt, now in ((at_once, True), (later, False)):
            ndt.reserve(len(scan))
            ndt.rows = change_points(ndt.grid, ndt.rows, ndt.half, scan, pose, sign, now)
    outdated = np.count_nonzero(later.grid.gaussians[: later.rows, 2] == OUTDATED)
    points, expected, found = room(7)[:100], np.empty(ENERGY_NUMBERS), np.empty(ENERGY_NUMBERS)
    for pose in np.random.default_rng(8).uniform(-0.3, 0.3, (10, 3)):
        for ndt, out in ((at_once, expected), (later, found)):
            association = begin_association(points)
            update_association(ndt.grid, ndt.half, association, pose)
            sum_association(association, 1.0, 1.0, out)
        assert expected[0] < -1.0
        np.testing.assert_array_equal(found, expected)
    left = np.count_nonzero(later.grid.gaussians[: later.rows, 2] == OUTDATED)
    assert 0 < left < outdated
    make_all_gaussians(later.grid, later.rows, later.half)
    np.testing.assert_array_equal(later.grid.gaussians[: later.rows], at_once.grid.gaussians[: later.rows])


def test_no_points_have_no_gaussians():
    ndt, out = outside_in(1), np.empty(ENERGY_NUMBERS)
    association = begin_association(np.empty((0, 2)))
    update_association(ndt.grid, ndt.half, association, np.zeros(3))
    sum_association(association, 1.0, 1.0, out)
    assert (out == 0.0).all()
    assert count_inliers(association, 9.0) == 0


def test_poses_that_are_not_numbers_have_no_gaussians():
    ndt = outside_in(1)
    association, out = begin_association(room(1)), np.empty(ENERGY_NUMBERS)
    for x in (np.nan, np.inf, 1e300):
        update_association(ndt.grid, ndt.half, association, np.array([x, 0.0, 0.0]))
        sum_association(association, 1.0, 0.0, out)
        assert not out[0] < -1e-300
