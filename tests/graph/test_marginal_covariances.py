from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.marginal_covariances import component_information, marginal_covariances
from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.optimise.whole_graph import components, optimise_graph
from nscan_cli.poses import compose, relative, rotated_information, wrap
from tests.data import data_file
from tests.graph.simulated_relations import (
    SIGMA,
    dense_matrix,
    disturbed,
    each_pair_once,
    energy_of,
    graph_of,
    mixed_ring,
    nscan_relation,
    pairwise_relations,
    ring,
    ring_edges,
)


def test_they_are_the_blocks_of_the_dense_inverse():
    truth, pairwise, nscan = mixed_ring(30, noise=1.0)
    graph = graph_of(truth, pairwise, nscan)
    optimise_graph(graph)
    energy = energy_of(truth, *each_pair_once(pairwise, nscan))
    component_information = 0.5 * dense_matrix(energy, energy.evaluate(graph.poses, exact=False).hessian)
    blocks = np.linalg.inv(component_information).reshape(29, 3, 29, 3)
    marginals = marginal_covariances(graph)
    assert sorted(marginals) == list(range(30))
    np.testing.assert_array_equal(marginals[0], np.zeros((3, 3)))
    for keyframe in range(1, 30):
        expected = blocks[keyframe - 1, :, keyframe - 1]
        np.testing.assert_allclose(marginals[keyframe], expected, rtol=1e-8, atol=1e-12)
        np.testing.assert_array_equal(marginals[keyframe], marginals[keyframe].T)
        assert np.linalg.eigvalsh(marginals[keyframe])[0] > 0


def test_the_covariances_of_a_chain_add_up_as_by_hand():
    # Two steps of 2 m ahead. The first turns the rest: y of pose 2 varies by (2 m · σ_φ)² more.
    C = np.diag(SIGMA**2)
    step, start = np.array([2.0, 0.0, 0.0]), np.array([7.0, -3.0, 0.8])
    poses = np.array([start, compose(start, step), compose(compose(start, step), step)])
    pairwise = [Pairwise((a, a + 1), step, np.linalg.inv(C), "odometry") for a in range(2)]
    marginals = marginal_covariances(graph_of(poses, pairwise, []))
    J = np.array([[1, 0, 0], [0, 1, 2], [0, 0, 1]])
    np.testing.assert_allclose(marginals[1], rotated_information(start, C), rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(
        marginals[2], rotated_information(start, J @ C @ J.T + C), rtol=1e-10, atol=1e-15
    )


def test_they_are_how_far_the_estimates_scatter():
    estimates = []
    for seed in range(150):
        truth = ring(8)
        pairwise = pairwise_relations(truth, ring_edges(8), np.random.default_rng(seed), noise=1.0)
        graph = graph_of(disturbed(truth, 0.05), pairwise, [])
        optimise_graph(graph)
        covariance = marginal_covariances(graph)[4]
        error = relative(graph.poses[4], graph.poses[0]) - relative(truth[4], truth[0])
        error[2] = wrap(error[2])
        rotated = rotated_information(-graph.poses[0], covariance)
        estimates.append(error @ np.linalg.solve(rotated, error))
    # χ² of 3 degrees: mean 3, standard deviation of the mean √(6/150) = 0.2.
    assert abs(np.mean(estimates) - 3) < 0.6


def test_the_same_scans_related_three_times_over_are_known_no_better():
    truth = ring(4)
    relation = nscan_relation(truth, range(4), np.random.default_rng(3))
    once = marginal_covariances(graph_of(truth, [], [relation]))
    thrice = marginal_covariances(graph_of(truth, [], [relation] * 3))
    for keyframe in range(1, 4):
        np.testing.assert_allclose(thrice[keyframe], once[keyframe], rtol=1e-9)


@pytest.mark.parametrize("step", [1e2, 1e5])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_chain_beyond_the_digits_of_its_numbers_has_finite_covariances(step: float, seed: int):
    """Odometry in the wrong unit: each step leaves the angle open by turns, a few matches hold it well.

    The matrix is indefinite by rounding, and pivot after pivot fails: without a bound the entries of the
    factor grow until they overflow.
    """
    rng, size = np.random.default_rng(seed), 660
    noise = rng.normal(0, [[0.05 * step], [0.02], [0.05]], (3, size))
    steps = np.array([step, 0.0, 0.0]) + noise.T
    poses = [np.zeros(3)]
    for each in steps:
        poses.append(compose(poses[-1], each))
    vague, sure = np.eye(3) / (0.1 * step) ** 2, np.diag([2e5, 2e5, 1e6])
    pairwise = [Pairwise((a, a + 1), each, vague, "track") for a, each in enumerate(steps)]
    pairwise += [Pairwise((a, a + 1), steps[a], sure, "track") for a in range(0, size - 1, 50)]
    graph = graph_of(np.array(poses), pairwise, [])
    _, factor = component_information(graph, components(graph)[0])
    assert factor.loose.any()
    assert np.abs(factor.panels).max() <= 1.01 * np.sqrt(factor.diagonal.max())
    marginals = marginal_covariances(graph)
    assert {0, 1} <= set(marginals)
    for covariance in marginals.values():
        assert np.isfinite(covariance).all()
        assert (np.diagonal(covariance) >= 0).all()


def test_keyframes_that_are_not_determined_are_left_out():
    truth, pairwise, nscan = mixed_ring(12, noise=1.0)
    graph = graph_of(np.vstack([truth, np.zeros((5, 3))]), pairwise, nscan)
    whole = marginal_covariances(graph)
    assert sorted(whole) == list(range(12))
    # 12 to 15 hang on 3 by a relation that leaves a corridor open; 16 on nothing.
    graph.pairwise.append(Pairwise((3, 12), np.ones(3), np.diag([1.0, 0.0, 50.0]), "loop"))
    for a in range(12, 15):
        graph.pairwise.append(Pairwise((a, a + 1), np.ones(3), np.diag([1e4, 1e4, 1e5]), "track"))
    marginals = marginal_covariances(graph)
    assert sorted(marginals) == list(range(12))
    for keyframe, covariance in whole.items():
        np.testing.assert_allclose(marginals[keyframe], covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.logs
@pytest.mark.parametrize("name", ["intel", "csail", "mit"])
def test_real_graphs_are_determined_unless_the_first_keyframe_lets_them_turn(name: str):
    graph = load_graph(str(data_file(f"{name}.g2o")))
    optimise_graph(graph)
    marginals = marginal_covariances(graph)
    assert len(marginals) == len(graph)
    assert np.isfinite(list(marginals.values())).all()
    # One relation ties the first keyframe to the others, without its angle: all of them may turn about
    # it. With long levers (csail), rounding in the factor must not pass for information.
    others = [r for r in graph.pairwise if 0 not in r.nodes]
    for node in (1, 50, 200, 300, 400, 500, 600, 700):
        tie = relative(graph.poses[node], graph.poses[0])
        graph.pairwise = [*others, Pairwise((0, node), tie, np.diag([1.0, 1.0, 0.0]), "odometry")]
        # The one that it is tied to has its place, but may turn as well.
        assert sorted(marginal_covariances(graph)) == [0]


def test_one_keyframe_alone_is_the_frame():
    marginals = marginal_covariances(graph_of(np.zeros((1, 3)), [], []))
    np.testing.assert_array_equal(marginals[0], np.zeros((3, 3)))
