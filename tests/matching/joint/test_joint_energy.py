from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from nscan_cli.matching.joint.gauge import gauge_directions
from nscan_cli.matching.joint.joint_energy import Priors, all_pairs, joint_energy, no_priors
from nscan_cli.ndt.energy import energy
from nscan_cli.poses import Array, compose, relative
from tests.matching.problems import Problem, near, office_problem
from tests.ndt import reference_ndt
from tests.ndt.differences import derivative

SCALE = 0.1
STEPS = np.array([2e-6, 2e-6, 4e-7])


@pytest.fixture(scope="module")
def five() -> Problem:
    return office_problem((300, 308, 316, 324, 332))


def priors_for(truth: Array, seed: int) -> Priors:
    """Priors from each scan to the next and from the last to the first, off the truth, of full rank."""
    rng = np.random.default_rng(seed)
    n = len(truth)
    pairs = np.array([(i, (i + 1) % n) for i in range(n)])
    means = relative(truth[pairs[:, 1]], truth[pairs[:, 0]]) + rng.normal(0, 0.1, (n, 3))
    roots = rng.normal(0, 10, (n, 3, 3))
    return Priors(pairs, means, roots @ roots.transpose(0, 2, 1))


def first(problem: Problem, n: int) -> Problem:
    return Problem(problem.truth[:n], problem.points[:n], problem.ndts[:n])


def pieces(problem: Problem, pairs: NDArray[np.int64], poses: Array) -> bytes:
    cells = [
        reference_ndt.lattice(problem.points[j], relative(poses[j], poses[i]), 0.5) for i, j in pairs.tolist()
    ]
    return b"".join(part.astype(np.int32).tobytes() for part in cells)


def test_it_is_the_sum_of_the_pairs_and_the_priors(five):
    poses, pairs = near(five.truth, 1), all_pairs(5)[[0, 3, 7, 18]]
    priors = priors_for(five.truth, 1)
    expected = 0.0
    for i, j in pairs.tolist():
        expected += SCALE * energy(five.ndts[i], five.points[j], relative(poses[j], poses[i])).value
    for (a, b), mean, information in zip(priors.pairs, priors.means, priors.information, strict=True):
        off = relative(poses[b], poses[a]) - mean
        off[2] = (off[2] + np.pi) % (2 * np.pi) - np.pi
        expected += 0.5 * off @ information @ off
    assert joint_energy(five.joint(pairs=pairs, priors=priors, scale=SCALE), poses).value == pytest.approx(
        expected
    )


def test_all_pairs_are_all_ordered_pairs():
    assert all_pairs(3).tolist() == [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]]


@pytest.mark.parametrize(("n", "with_priors", "widening"), [(2, False, 1.0), (3, True, 1.0), (5, True, 0.3)])
def test_gradient_and_hessian_are_the_derivatives(five, n, with_priors, widening):
    problem = first(five, n)
    priors = priors_for(problem.truth, n) if with_priors else no_priors()
    joint = problem.joint(priors=priors, scale=SCALE)
    steps = np.tile(STEPS, n)
    checked = 0
    # One variable at a time: among all 3n, some point always crosses a border.
    for seed in range(4):
        start = near(problem.truth, seed, 0.2, 0.05).ravel()
        found = joint_energy(joint, start.reshape(n, 3), widening)
        for variable in range(3 * n):

            def place(shift: Array, at: Array = start, axis: int = variable) -> Array:
                moved = at.copy()
                moved[axis] += shift[0]
                return moved.reshape(n, 3)

            def function(shift: Array, place: Callable[[Array], Array] = place) -> Array:
                there = joint_energy(joint, place(shift), widening)
                return np.append(there.gradient, there.value)

            def piece(shift: Array, place: Callable[[Array], Array] = place) -> bytes:
                return pieces(problem, joint.pairs, place(shift))

            rows = derivative(function, piece, np.zeros(1), steps[variable : variable + 1])
            if rows is None:
                continue
            checked += 1
            by_gradient, by_value = rows[0, :-1], rows[0, -1]
            largest = np.abs(found.hessian).max()
            np.testing.assert_allclose(found.hessian[variable], by_gradient, atol=1e-6 * largest)
            assert found.gradient[variable] == pytest.approx(
                by_value, abs=1e-6 * np.abs(found.gradient).max()
            )
    assert checked >= 3 * n


def test_without_the_exact_terms_the_hessian_is_semi_definite(five):
    joint = five.joint(priors=priors_for(five.truth, 3), scale=SCALE)
    indefinite = 0
    for seed in range(10):
        poses = near(five.truth, seed, 0.4, 0.2)
        eigenvalues = np.linalg.eigvalsh(joint_energy(joint, poses, exact=False).hessian)
        assert eigenvalues[0] >= -1e-12 * eigenvalues[-1]
        exact = joint_energy(joint, poses).hessian
        indefinite += np.linalg.eigvalsh(exact)[0] < -1e-6 * eigenvalues[-1]
    assert indefinite > 0


def test_a_global_motion_changes_nothing(five):
    joint = five.joint(priors=priors_for(five.truth, 4), scale=SCALE)
    poses = near(five.truth, 4)
    here = joint_energy(joint, poses)
    motion = np.array([30.0, -12.0, 2.5])
    there = joint_energy(joint, compose(motion, poses))
    assert there.value == pytest.approx(here.value, rel=1e-9)
    null = gauge_directions(poses)
    np.testing.assert_allclose(null.T @ null, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(null.T @ here.gradient, 0, atol=1e-9 * np.abs(here.gradient).max())
    part = joint_energy(joint, poses, exact=False).hessian
    np.testing.assert_allclose(part @ null, 0, atol=1e-9 * np.abs(part).max())


def test_motion_model_compare_angles_across_the_jump():
    """Poses at ±179°: their difference is 2°, and a prior of 2° is met."""
    poses = np.array([[0.0, 0.0, np.radians(179)], [0.0, 0.0, np.radians(-179)]])
    prior = Priors(np.array([[0, 1]]), np.array([[0.0, 0.0, np.radians(2)]]), np.eye(3)[None])
    none = np.empty((0, 2), dtype=np.int64)
    found = joint_energy(office_problem((0, 1)).joint(pairs=none, priors=prior), poses)
    assert found.value == pytest.approx(0, abs=1e-20)
    np.testing.assert_allclose(found.gradient, 0, atol=1e-12)
