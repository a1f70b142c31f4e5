from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise_solver import PairProblem, minimise_pairwise, pairwise_objective
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array
from tests.ndt import reference_ndt
from tests.ndt.differences import derivative
from tests.ndt.transforms import ndt_of
from tests.ndt.wall_points import room

MEAN = np.array([0.3, -0.2, 3.1])
INFORMATION = np.array([[50.0, 10.0, 0.0], [10.0, 80.0, -5.0], [0.0, -5.0, 200.0]])
SCALE = 0.1


def evaluate(ndt: Ndt, points: Array, pose: Array, curvature: float = 1.0) -> tuple[float, Array, Array]:
    gradient, hessian = np.empty(3), np.empty((3, 3))
    problem = PairProblem(ndt.grid, ndt.half, begin_association(points), SCALE, Prior(MEAN, INFORMATION))
    value = pairwise_objective(problem, pose, 1.0, curvature, np.empty(ENERGY_NUMBERS), gradient, hessian)
    return value, gradient, hessian


def run(ndt: Ndt, points: Array, start: Array, mean: Array, information: Array, near: float = 1e-6):
    pose, hessian = start.copy(), np.empty((3, 3))
    problem = PairProblem(ndt.grid, ndt.half, begin_association(points), SCALE, Prior(mean, information))
    outcome = minimise_pairwise(problem, pose, np.array([0.05, 0.3, 1.0]), 30, near, 1e-6, hessian)
    return pose, hessian, outcome


def test_gradient_and_hessian_of_the_objective_are_its_derivatives():
    """With the prior's mean near +π and poses beyond: the prior's angle goes the short way round."""
    ndt, points = ndt_of(room(1)), room(2)
    rng = np.random.default_rng(2)
    checked = 0
    for pose in MEAN + rng.uniform(-0.3, 0.3, (20, 3)) + np.array([0, 0, -2 * np.pi]):
        rows = derivative(
            lambda p: np.append(evaluate(ndt, points, p)[1], evaluate(ndt, points, p)[0]),
            lambda p: reference_ndt.lattice(points, p, 0.5).tobytes(),
            pose,
            np.array([1e-5, 1e-5, 2e-6]),
        )
        if rows is None:
            continue
        checked += 1
        _, gradient, hessian = evaluate(ndt, points, pose)
        np.testing.assert_allclose(gradient, rows[:, 3], atol=1e-6 * np.abs(gradient).max())
        np.testing.assert_allclose(hessian, rows[:, :3], atol=1e-6 * np.abs(hessian).max())
    assert checked >= 5


def test_without_overlap_the_prior_is_the_minimum():
    ndt = ndt_of(room(1) + 1000)
    pose, hessian, found = run(ndt, room(2), np.zeros(3), MEAN, INFORMATION)
    assert found.converged
    assert (found.value, found.energy) == (pytest.approx(0, abs=1e-9), 0.0)
    np.testing.assert_allclose(pose, MEAN, atol=1e-6)
    np.testing.assert_allclose(hessian, INFORMATION)


def test_without_anything_the_pose_stays():
    ndt = ndt_of(room(1) + 1000)
    pose, _, found = run(ndt, room(2), np.array([1.0, 2.0, 0.5]), np.zeros(3), np.zeros((3, 3)))
    assert (found.value, found.energy) == (0.0, 0.0)
    np.testing.assert_allclose(pose, [1.0, 2.0, 0.5])


@pytest.mark.parametrize("seed", range(5))
def test_a_moved_copy_is_brought_back(seed):
    """The points themselves, started 0.3 m and 0.1 rad off: the minimum is near the true place."""
    rng = np.random.default_rng(seed)
    points = room(seed)
    start = rng.uniform(-1, 1, 3) * [0.3, 0.3, 0.1]
    pose, hessian, found = run(ndt_of(points), points, start, np.zeros(3), np.zeros((3, 3)))
    assert found.converged
    assert found.evaluations < 60
    assert np.abs(pose).max() < 0.03
    assert found.value == pytest.approx(SCALE * found.energy)
    assert np.linalg.eigvalsh(hessian)[0] > 0


@pytest.mark.parametrize("seed", range(5))
def test_wide_stages_that_end_early_lead_to_a_minimum_as_near_the_truth(seed):
    start = np.random.default_rng(seed).uniform(-1, 1, 3) * [0.3, 0.3, 0.1]
    ndt, points = ndt_of(room(seed)), room(seed)
    whole, _, at_ease = run(ndt, points, start, np.zeros(3), np.zeros((3, 3)))
    early, _, in_haste = run(ndt, points, start, np.zeros(3), np.zeros((3, 3)), near=0.01)
    assert max(np.abs(early).max(), np.abs(whole).max()) < 0.03
    assert in_haste.evaluations < at_ease.evaluations
