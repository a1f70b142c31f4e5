from __future__ import annotations

import sys

import numpy as np
import pytest

from nscan_cli.matching.joint.gauge import FREE_GAUGE, gauge_directions, gauge_fixed_step
from nscan_cli.matching.joint.joint_energy import JointProblem, Priors, all_pairs, joint_energy, no_priors
from nscan_cli.matching.joint.joint_match import match_jointly
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import overlaps
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.uncertainty import weakest_translation
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import relative
from tests.matching.problems import Problem, errors, fig_3, near, office_problem
from tests.ndt.wall_points import room

NOISE = 0.015
"""Standard deviation (m) of the simulated laser's ranges."""


@pytest.fixture(scope="module")
def five() -> Problem:
    """Five scans in and about an office's door, half a metre apart."""
    return office_problem((2000, 2008, 2016, 2024, 2032))


def test_the_free_step_is_the_smallest_that_solves(five):
    poses = near(five.truth, 1)
    here = joint_energy(five.joint(), poses, exact=False)
    step = np.empty((5, 3))
    assert gauge_fixed_step(here.gradient, here.hessian, poses, 0.0, FREE_GAUGE, step)
    values, vectors = np.linalg.eigh(here.hessian)
    assert values[2] < 1e-9 * values[-1] < values[3]
    inverse = np.where(np.arange(15) < 3, 0.0, 1 / values)
    smallest = -(vectors * inverse) @ vectors.T @ here.gradient
    np.testing.assert_allclose(step.ravel(), smallest, atol=1e-4 * np.abs(smallest).max())
    np.testing.assert_allclose(gauge_directions(poses).T @ step.ravel(), 0, atol=1e-9)


def test_a_fixed_step_solves_for_the_others(five):
    poses = near(five.truth, 2)
    here = joint_energy(five.joint(), poses, exact=False)
    step = np.empty((5, 3))
    assert gauge_fixed_step(here.gradient, here.hessian, poses, 0.0, 2, step)
    assert not step[2].any()
    others = np.delete(np.arange(15), [6, 7, 8])
    solved = np.linalg.solve(here.hessian[np.ix_(others, others)], -here.gradient[others])
    np.testing.assert_allclose(step.ravel()[others], solved, atol=1e-4 * np.abs(solved).max())


def test_there_is_no_step_where_the_hessian_is_not_positive():
    poses = np.arange(6.0).reshape(2, 3)
    assert not gauge_fixed_step(np.ones(6), -np.eye(6), poses, 0.0, FREE_GAUGE, np.empty((2, 3)))


@pytest.mark.parametrize("rows", [(2000, 2008, 2016, 2024, 2032), (2000, 2012, 2024, 2036)])
def test_both_gauges_find_the_same_relative_poses(rows):
    problem = office_problem(rows)
    n, found = len(rows), []
    start = near(problem.truth, 3)
    for fixed in (None, 0, n - 1):
        match = match_jointly(problem.joint(), start, JointOptions(fixed=fixed))
        assert match.converged
        if fixed is not None:
            np.testing.assert_array_equal(match.poses[fixed], start[fixed])
        found.append(match)
        assert np.abs(errors(match.poses, problem.truth)[:, :2]).max() < 2 * NOISE
    for match in found[1:]:
        # Where the energy jumps at a cell border, the two may stop on either side of a few points' steps.
        assert np.abs(errors(match.poses, found[0].poses)).max() < 1e-3
        assert match.energy == pytest.approx(found[0].energy, abs=5 * problem.joint().scale)


def test_the_result_is_a_minimum_with_the_gauge_in_its_hessian(five):
    match = match_jointly(five.joint(), near(five.truth, 4), JointOptions())
    again = joint_energy(five.joint(), match.poses)
    assert match.energy == pytest.approx(again.value, rel=1e-12)
    np.testing.assert_allclose(match.hessian, again.hessian, rtol=1e-9, atol=1e-6)
    values = np.linalg.eigvalsh(match.hessian)
    # The turn of all scans has the curvature of what gradient is left at a cell border, see below.
    assert np.sort(np.abs(values[:3]))[1] < 1e-9 * values[3]
    assert np.abs(values[:3]).max() < 1e-3 * values[3]


def test_less_thorough_the_last_step_is_taken_without_a_look(five):
    start = near(five.truth, 4)
    whole = match_jointly(five.joint(), start, JointOptions(tolerance=1e-3))
    match = match_jointly(five.joint(), start, JointOptions(tolerance=1e-3, thorough=False))
    assert match.converged
    # One evaluation less in each of the four descents.
    assert match.evaluations <= whole.evaluations - 4
    assert np.abs(errors(match.poses, whole.poses)).max() < 1e-3
    assert match.energy == pytest.approx(whole.energy, rel=1e-3)
    scale = np.abs(whole.hessian).max()
    np.testing.assert_allclose(match.hessian, whole.hessian, atol=0.02 * scale)


def test_off_a_minimum_the_turn_of_all_scans_has_the_curvature_of_its_gradient(five):
    """E stays the same along the circles p(θ) on which all scans turn: p'ᵗ H p' + gᵗ p'' = 0.

    So the Hessian's third null direction is one only where the gradient is zero; the shifts always are.
    """
    poses = near(five.truth, 5)
    here = joint_energy(five.joint(), poses)
    directions = gauge_directions(poses)
    radius = np.zeros((5, 3))
    radius[:, :2] = poses[:, :2] - poses[:, :2].mean(axis=0)
    curvature = directions.T @ here.hessian @ directions
    turned = here.gradient @ radius.ravel() * directions[2, 2] ** 2
    assert abs(turned) > 1
    assert curvature[2, 2] == pytest.approx(turned, rel=1e-6)
    np.testing.assert_allclose(curvature[:2, :2], 0, atol=1e-6 * abs(turned))


def test_without_pairs_the_priors_are_met():
    problem = office_problem((0, 400, 800))
    chain = np.array([[0, 1], [1, 2]])
    off = np.array([0.1, -0.2, 0.05])
    means = relative(problem.truth[[1, 2]], problem.truth[[0, 1]]) + off
    priors = Priors(chain, means, np.tile(np.eye(3) * 100, (2, 1, 1)))
    none = np.empty((0, 2), dtype=np.int64)
    match = match_jointly(
        problem.joint(pairs=none, priors=priors), problem.truth, JointOptions(tolerance=1e-6)
    )
    assert match.converged
    assert match.energy == pytest.approx(0, abs=1e-9)
    found = relative(match.poses[[1, 2]], match.poses[[0, 1]])
    np.testing.assert_allclose(found, means, atol=1e-5)


@pytest.mark.parametrize(("noise", "factor"), [(False, 80), (True, 50)])
def test_fig_3_is_known_jointly_where_its_pairs_are_not(noise, factor):
    """The paper's Fig. 3: (1, 2) leave open the way along the corridor, (1, 3) the way across it.

    The information on the others' poses with scan 1 held, at the true poses, from both directions of
    each pair.
    """
    problem = fig_3(noise)
    whole = joint_energy(problem.joint(scale=1.0), problem.truth).hessian[3:, 3:]
    smallest = np.linalg.eigvalsh(whole)[0]
    for other, direction in ((1, 0.0), (2, 90.0)):
        chosen = problem.joint(0, other, scale=1.0)
        pair = joint_energy(chosen, problem.truth[[0, other]]).hessian[3:, 3:]
        values = np.linalg.eigvalsh(pair)
        assert values[0] < 0.01 * values[1]
        assert smallest > factor * values[0]
        off = np.degrees(weakest_translation(pair, 0.05).direction) - direction
        assert abs((off + 90) % 180 - 90) < 5


def test_stages_that_are_cut_off_on_the_way_are_counted():
    problem = office_problem((300, 304, 308))
    start = problem.truth + np.array([[0.0, 0.0, 0.0], [0.1, 0.05, 0.05], [-0.1, 0.1, -0.05]])
    for most, unsettled in ((30, 0), (1, 3)):
        options = JointOptions(approach_iterations=most)
        match = match_jointly(problem.joint(), start, options)
        assert (match.converged, match.unsettled) == (True, unsettled)


def test_leaf_kernels_keep_no_reference_and_give_none_back():
    """Leaf kernels count no references: after many calls every array has as many as before."""
    points, poses = [room(1), room(2)], np.array([[0.0, 0, 0], [0.1, 0, 0.05]])
    ndts = [
        Ndt.of_scans(part, np.array([0, len(part)]), np.zeros((1, 3)), GaussianOptions(0.5, 3))
        for part in points
    ]
    problem = JointProblem(scan_set(ndts, points), all_pairs(2), no_priors(), 1.0)
    arrays = [
        np.asarray(array) for array in (*problem.scans.grid, problem.scans.points, problem.pairs, poses)
    ]

    def owned() -> list[int]:
        return [sys.getrefcount(array) for array in arrays]

    joint_energy(problem, poses)
    overlaps(problem.scans, poses, JointOptions.inlier_bound)
    before, values = owned(), [array.copy() for array in arrays]
    for _ in range(100):
        joint_energy(problem, poses)
        overlaps(problem.scans, poses, JointOptions.inlier_bound)
    assert owned() == before
    for array, value in zip(arrays, values, strict=True):
        np.testing.assert_array_equal(array, value)
