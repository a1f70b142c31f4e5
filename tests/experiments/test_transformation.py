from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.graph_solver import optimise_poses
from nscan_cli.poses import Array, compose, relative
from tests.experiments import transformation
from tests.experiments.fixed_mapping import MAX_ITERATIONS, FixedMapping, VariableMapping, minimise
from tests.experiments.mappings import Mapping, differences, grouped, mean, of_pose_c, optimal, with_c_held
from tests.experiments.transformation import MAPPINGS, NEAR, problem_of, report
from tests.graph.simulated_relations import (
    dense_matrix,
    disturbed,
    graph_of,
    mixed_ring,
    nscan_relation,
    pairwise_relations,
    ring,
    ring_edges,
)

COUNT = 12


def chosen_ring(noise: float) -> tuple[Array, VariableMapping]:
    truth, pairwise, nscan = mixed_ring(COUNT, noise)
    return truth, VariableMapping(COUNT, [*pairwise, *nscan], np.arange(COUNT))


def held_ring(mapping: Mapping, noise: float, c_held: bool = False) -> FixedMapping:
    _, pairwise, nscan = mixed_ring(COUNT, noise)
    if c_held:
        nscan = [with_c_held(relation) for relation in nscan]
    return FixedMapping(COUNT, pairwise, nscan, np.arange(COUNT), mapping)


@pytest.mark.parametrize("c_held", [False, True])
@pytest.mark.parametrize("mapping", MAPPINGS.values())
def test_all_ways_reach_the_minimum_of_a_small_consistent_graph(mapping, c_held):
    truth, chosen = chosen_ring(0.0)
    best = minimise(chosen, disturbed(truth, 0.1))
    found = minimise(held_ring(mapping, 0.0, c_held), disturbed(truth, 0.1), 2000)
    assert best.converged
    assert found.converged
    np.testing.assert_allclose(relative(best.poses, truth), 0, atol=1e-9)
    # Where the steps shrink slowly, the last one is far shorter than what is left.
    np.testing.assert_allclose(relative(found.poses, truth), 0, atol=5e-4)
    assert found.energy < 1e-6
    if mapping is not optimal and not c_held:
        assert found.iterations <= best.iterations + 2
    else:
        assert found.iterations > 10 * best.iterations


@pytest.mark.parametrize("mapping", [of_pose_c, mean])
def test_with_the_gauge_free_a_held_mapping_ends_near_the_minimum_of_a_noisy_graph(mapping):
    truth, chosen = chosen_ring(1.0)
    best, found = optimise_poses(chosen, truth), minimise(held_ring(mapping, 1.0), truth)
    assert found.converged
    assert chosen.evaluate(found.poses, exact=False).value == pytest.approx(best.energy, rel=1e-4)
    np.testing.assert_allclose(relative(found.poses, best.poses), 0, atol=1e-3)


@pytest.mark.parametrize("mapping", MAPPINGS.values())
def test_with_pose_c_held_a_held_mapping_ends_elsewhere_on_a_noisy_graph(mapping):
    truth, chosen = chosen_ring(1.0)
    best, found = optimise_poses(chosen, truth), minimise(held_ring(mapping, 1.0, True), truth, 2000)
    assert found.converged
    assert chosen.evaluate(found.poses, exact=False).value > 2 * best.energy


def test_the_chosen_way_steps_as_the_tool_does():
    truth, chosen = chosen_ring(1.0)
    start = disturbed(truth, 0.5)
    tool, found = optimise_poses(chosen, start), minimise(chosen, start)
    assert abs(tool.iterations - found.iterations) <= 2
    np.testing.assert_allclose(relative(found.poses, tool.poses), 0, atol=1e-6)


@pytest.mark.parametrize("c_held", [False, True])
def test_the_mapping_of_c_gives_the_energy_of_the_chosen_one(c_held):
    truth, chosen = chosen_ring(1.0)
    poses, held = disturbed(truth, 0.5), held_ring(of_pose_c, 1.0, c_held)
    assert held.value_with(poses, held.mappings_at(poses)) == pytest.approx(
        chosen.evaluate(poses, exact=False).value
    )


@pytest.mark.parametrize("mapping", MAPPINGS.values())
def test_the_held_function_has_the_derivatives_that_it_says(mapping):
    _, _, nscan = mixed_ring(COUNT, 1.0)
    # Without pairwise relations nothing is left out of the Hessian.
    held = FixedMapping(COUNT, [], nscan, np.arange(COUNT), mapping)
    poses = disturbed(ring(COUNT), 0.3)
    mappings = held.mappings_at(poses)
    system = held.evaluate_with(poses, mappings)
    assert system.value == pytest.approx(held.value_with(poses, mappings))
    h, gradient, hessian = 1e-4, [], []
    for index in range(3 * COUNT):
        by = h * np.eye(3 * COUNT)[index].reshape(COUNT, 3)
        after, before = (held.evaluate_with(poses + sign * by, mappings) for sign in (1, -1))
        gradient.append((after.value - before.value) / (2 * h))
        hessian.append((after.gradient - before.gradient).ravel() / (2 * h))
    # A quadratic function: central differences are exact but for rounding.
    scale = np.abs(system.hessian).max()
    np.testing.assert_allclose(system.gradient.ravel(), gradient[3:], atol=1e-7 * scale)
    np.testing.assert_allclose(dense_matrix(held, system.hessian), hessian[3:], atol=1e-7 * scale)


@settings(deadline=None, max_examples=50)
@given(
    st.integers(0, 1000),
    st.booleans(),
    st.floats(0.01, 1.0),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3)),
    st.floats(-4, 0),
)
def test_no_mapping_is_better_than_the_optimal_one(seed, c_held, off, by, exponent):
    rng = np.random.default_rng(seed)
    truth = ring(4, 2.0)
    relation = nscan_relation(truth, [2, 0, 1, 3], rng, 1.0)
    (group,) = grouped([with_c_held(relation) if c_held else relation], np.arange(4))
    poses = disturbed(truth, off, seed)[group.members]
    best = optimal(group, poses)

    def value(mapping: Array) -> float:
        f = differences(group, poses, mapping).ravel()
        return float(f @ group.hessians[0] @ f)

    least = value(best)
    # Both ways round: the perturbation in local coordinates, and in global ones.
    small = 10**exponent * np.array(by)
    for other in (compose(small, best), compose(best, small), mean(group, poses), of_pose_c(group, poses)):
        assert least <= value(other) * (1 + 1e-6) + 1e-9


def test_the_mappings_of_poses_that_fit_are_all_the_same_one():
    rng = np.random.default_rng(3)
    truth = ring(5, 2.0)
    relation = nscan_relation(truth, [0, 1, 2, 3, 4], rng)
    (group,) = grouped([with_c_held(relation)], np.arange(5))
    poses = truth[group.members]
    for mapping in MAPPINGS.values():
        f = differences(group, poses, mapping(group, poses))
        np.testing.assert_allclose(f, 0, atol=1e-6)


def small_graph() -> Graph:
    """A chain and joint relations, as `slam` gives them, with odometry that drifts."""
    rng = np.random.default_rng(5)
    truth = ring(COUNT)
    chain = pairwise_relations(truth, ring_edges(COUNT)[:-1], rng, 1.0)
    nscan = [nscan_relation(truth, [(s + i) % COUNT for i in range(4)], rng, 1.0) for s in range(0, COUNT, 2)]
    graph = graph_of(truth, [dataclasses.replace(each, origin="track") for each in chain], nscan)
    graph.odometry = disturbed(truth, 0.2)
    return graph


def test_every_start_keeps_the_first_pose_and_is_off_the_minimum():
    graph = small_graph()
    problem = problem_of("small", graph)
    assert len(problem.starts) == 5
    for start in problem.starts.values():
        np.testing.assert_allclose(start[0], graph.poses[0], atol=1e-12)
        assert np.abs(start - graph.poses).max() > 0.01
    again = problem_of("small", graph)
    for name, start in problem.starts.items():
        np.testing.assert_array_equal(start, again.starts[name])


def test_the_report_tells_all_ways_from_all_starts(monkeypatch):
    problem = problem_of("small", small_graph())
    monkeypatch.setattr(transformation, "problems", lambda: (problem,))
    written = report()
    assert len(written.rows) == 8
    assert all(len(row) == len(written.header) for row in written.rows)
    assert written.header[-1] == NEAR
    tool, held_c = (written.rows[row][-1] for row in (0, 2))
    assert int(tool.split()[0]) <= int(held_c.split()[0]) < MAX_ITERATIONS
    assert tool.split()[1] == held_c.split()[1]
    assert [line.split()[2] for line in written.left_out] == ["mit-csail,", "intel,"]
