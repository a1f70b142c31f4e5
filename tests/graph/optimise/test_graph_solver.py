from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.graph_solver import StopOptions, optimise_poses
from nscan_cli.poses import compose, relative, wrap
from tests.graph.simulated_relations import disturbed, energy_of, mixed_ring


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(6, 30))
def test_exact_relations_of_both_kinds_lead_back_to_the_truth(seed: int, count: int):
    truth, pairwise, nscan = mixed_ring(count, noise=0.0, seed=seed)
    found = optimise_poses(
        energy_of(truth, pairwise, nscan), disturbed(truth, 0.5, seed), StopOptions(100, 1e-9)
    )
    assert found.converged
    assert found.energy < 1e-12
    np.testing.assert_allclose(found.poses[:, :2], truth[:, :2], atol=1e-8)
    np.testing.assert_allclose(wrap(found.poses[:, 2] - truth[:, 2]), 0, atol=1e-8)


def test_noise_leaves_a_minimum_with_as_much_energy_as_there_is_redundancy():
    truth, pairwise, nscan = mixed_ring(80, noise=1.0)
    energy = energy_of(truth, pairwise, nscan)
    found = optimise_poses(energy, disturbed(truth, 0.5))
    assert found.converged
    assert np.abs(energy.evaluate(found.poses, exact=False).gradient).max() < 1e-3
    # χ²: residuals less unknowns is what is left on average, with a variance of twice that.
    freedom = 3 * len(pairwise) + sum(3 * len(relation.nodes) - 3 for relation in nscan) - 3 * 79
    assert abs(found.energy - freedom) < 3 * np.sqrt(2 * freedom)


def test_the_fixed_pose_stays_and_choosing_another_changes_the_frame_alone():
    truth, pairwise, nscan = mixed_ring(12, noise=1.0)
    start = disturbed(truth, 0.3)
    first, other = (
        optimise_poses(energy_of(truth, pairwise, nscan, fixed), start, StopOptions(100, 1e-9))
        for fixed in (0, 7)
    )
    np.testing.assert_array_equal(other.poses[7], start[7])
    assert other.energy == pytest.approx(first.energy, rel=1e-9)
    moved = compose(first.poses[7], relative(other.poses, other.poses[7]))
    np.testing.assert_allclose(moved, first.poses, atol=1e-6)


def test_the_exact_hessian_ends_in_fewer_steps():
    # Relations that contradict each other leave large residuals; there Gauss–Newton only creeps.
    truth, pairwise, nscan = mixed_ring(30, noise=6.0)
    energy = energy_of(truth, pairwise, nscan)
    found = optimise_poses(energy, truth)
    slow = optimise_poses(energy, truth, StopOptions(exact_hessian_step=0.0))
    assert found.converged
    assert found.energy == pytest.approx(slow.energy, rel=1e-6)
    assert found.iterations < slow.iterations


def test_an_exact_hessian_that_is_not_positive_definite_is_left_for_the_part_that_is():
    truth, pairwise, nscan = mixed_ring(30, noise=1.0)
    energy, start = energy_of(truth, pairwise, nscan), disturbed(truth, 3.0)
    best = optimise_poses(energy, truth)
    found = optimise_poses(energy, start, StopOptions(exact_hessian_step=np.inf))
    assert found.energy == pytest.approx(best.energy, rel=1e-9)
    assert found.iterations <= 15


def test_a_direction_that_no_relation_holds_does_not_break_the_rest():
    # Pose 2 may turn freely, pose 4 has no relation at all.
    truth, pairwise, _ = mixed_ring(5, noise=0.0)
    pairwise = [Pairwise((a, a + 1), relative(truth[a + 1], truth[a]), np.eye(3), "track") for a in range(2)]
    pairwise[1].information[2, 2] = 0.0
    pairwise.append(Pairwise((0, 3), relative(truth[3], truth[0]), np.eye(3), "loop"))
    start = disturbed(truth, 0.3)
    found = optimise_poses(energy_of(truth, pairwise, []), start)
    assert found.converged
    assert found.energy < 1e-9
    np.testing.assert_allclose(relative(found.poses[[1, 3]], truth[[1, 3]]), 0, atol=1e-4)
    np.testing.assert_allclose(found.poses[2, :2], truth[2, :2], atol=1e-4)
    np.testing.assert_allclose(found.poses[4], start[4], atol=1e-12)


def test_relations_without_any_information_move_nothing():
    truth, pairwise, nscan = mixed_ring(6, noise=0.0)
    nothing = [Pairwise(r.nodes, r.measurement, np.zeros((3, 3)), r.origin) for r in pairwise]
    empty = [NScan(r.nodes, r.poses, 0 * r.hessian, r.fixed, r.origin) for r in nscan]
    start = disturbed(truth, 0.3)
    found = optimise_poses(energy_of(truth, nothing, empty), start)
    assert found.energy == 0
    np.testing.assert_allclose(relative(found.poses, start), 0, atol=1e-12)


def test_an_energy_without_a_minimum_ends_unconverged_with_finite_poses():
    relation = NScan((0, 1), np.zeros((2, 3)), -np.eye(6), 0, "nscan")
    found = optimise_poses(energy_of(np.zeros((2, 3)), [], [relation]), np.array([[0, 0, 0], [0.1, 0, 0]]))
    assert not found.converged
    assert np.isfinite(found.poses).all()


@pytest.mark.parametrize("count", [1, 2])
def test_poses_without_relations_stay(count: int):
    start = np.arange(3.0 * count).reshape(count, 3) / 10
    found = optimise_poses(energy_of(start, [], []), start)
    np.testing.assert_array_equal(found.poses, start)
    assert found.energy == 0


def test_no_iterations_at_all_give_the_start_back():
    truth, pairwise, nscan = mixed_ring(6, noise=1.0)
    found = optimise_poses(energy_of(truth, pairwise, nscan), truth, StopOptions(0))
    assert (found.iterations, found.converged) == (0, False)
    np.testing.assert_allclose(relative(found.poses, truth), 0, atol=1e-12)
