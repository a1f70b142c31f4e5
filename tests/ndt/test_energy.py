from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.ndt.energy import energy, inlier_share
from nscan_cli.poses import Array
from tests.ndt import reference_ndt
from tests.ndt.differences import derivative
from tests.ndt.transforms import ndt_of
from tests.ndt.wall_points import room

STEPS = np.array([1e-5, 1e-5, 2e-6])


def random_poses(seed: int, count: int) -> Array:
    """(count, 3): small motions at first, then any."""
    rng = np.random.default_rng(seed)
    spread = np.linspace(0.02, 1.0, count)[:, None]
    poses: Array = spread * rng.uniform(-1, 1, (count, 3)) * [1.5, 1.5, np.pi]
    return poses


@pytest.mark.parametrize("widening", [1.0, 0.05])
def test_the_energy_is_that_of_its_definition(widening):
    found = reference_ndt.gaussians(room(1), 1.0, 3, 0.02)
    ndt = ndt_of(room(1))
    for pose in random_poses(1, 8):
        distances = reference_ndt.mahalanobis(found, 1.0, room(2), pose)
        expected = -np.exp(-0.5 * widening * distances).sum()
        assert expected < -0.1
        assert energy(ndt, room(2), pose, widening).value == pytest.approx(expected, rel=1e-7)
        share = inlier_share(ndt.grid, ndt.half, room(2), pose, 9.0)
        assert share == pytest.approx((distances.min(axis=1) < 9.0).mean())


@pytest.mark.parametrize("widening", [1.0, 0.3, 0.05])
def test_gradient_and_hessian_are_the_derivatives(widening):
    ndt, points = ndt_of(room(3)), room(4)

    def piece(pose: Array) -> bytes:
        return reference_ndt.lattice(points, pose, 0.5).tobytes()

    checked = 0
    for pose in random_poses(3, 60):
        by_value = derivative(lambda p: energy(ndt, points, p, widening).value, piece, pose, STEPS)
        by_gradient = derivative(lambda p: energy(ndt, points, p, widening).gradient, piece, pose, STEPS)
        if by_value is None or by_gradient is None:
            continue
        checked += 1
        found = energy(ndt, points, pose, widening)
        np.testing.assert_allclose(found.gradient, by_value, atol=1e-6 * np.abs(by_value).max())
        np.testing.assert_allclose(found.hessian, by_gradient, atol=1e-6 * np.abs(by_gradient).max())
    assert checked >= 20


def test_without_its_negative_terms_the_hessian_is_semi_definite():
    ndt, points = ndt_of(room(5)), room(6)
    indefinite = 0
    for pose in random_poses(5, 40):
        exact, part = energy(ndt, points, pose), energy(ndt, points, pose, exact=False)
        assert (part.value, part.gradient.tolist()) == (exact.value, exact.gradient.tolist())
        eigenvalues = np.linalg.eigvalsh(part.hessian)
        assert eigenvalues[0] >= -1e-12 * eigenvalues[-1]
        indefinite += np.linalg.eigvalsh(exact.hessian)[0] < 0
    assert indefinite > 10


def test_far_away_there_is_no_energy():
    found = energy(ndt_of(room(1)), room(2), np.array([500.0, -300.0, 1.0]))
    assert found.value == 0.0
    assert not found.gradient.any()
    assert not found.hessian.any()


def test_no_points_have_no_inliers():
    ndt = ndt_of(room(1))
    assert inlier_share(ndt.grid, ndt.half, np.empty((0, 2)), np.zeros(3), 9.0) == 0.0
