from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.chordal import chordal_start
from nscan_cli.graph.optimise.graph_solver import StopOptions, optimise_poses
from nscan_cli.graph.optimise.whole_graph import components, optimise_graph
from nscan_cli.poses import compose, relative
from tests.data import data_file
from tests.graph.simulated_relations import disturbed, energy_of, graph_of, mixed_ring, streets


@pytest.mark.logs
@pytest.mark.parametrize(
    ("name", "minimum"), [("intel", 45.004696), ("csail", 40.555129), ("mit", 41.163269)]
)
def test_the_known_minima_of_real_graphs(name: str, minimum: float):
    # As SuperLU with plain Gauss–Newton found them too; mit from its given poses ends at 770.66.
    graph = load_graph(str(data_file(f"{name}.g2o")))
    first = graph.poses[0].copy()
    result = optimise_graph(graph)
    assert result.converged
    assert len(components(graph)) == 1
    assert result.energy == pytest.approx(minimum, abs=1e-6)
    again = energy_of(graph.poses, graph.pairwise, []).evaluate(graph.poses, exact=False)
    assert again.value == pytest.approx(minimum, abs=1e-6)
    np.testing.assert_allclose(relative(graph.poses[0], first), 0, atol=1e-12)


def graph_in_parts() -> Graph:
    """Two rings and a keyframe (20) alone, with scans attached; keyframes of the parts take turns."""
    truth, pairwise, nscan = mixed_ring(10, noise=1.0)
    poses = np.zeros((24, 3))
    poses[0:20:2] = disturbed(truth, 0.3)
    poses[1:20:2] = compose([40.0, 0.0, 1.0], disturbed(truth, 0.3, seed=2))
    poses[20] = [5.0, 6.0, 7.0]
    poses[21:] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [5.0, 5.0, 7.0]]
    graph = graph_of(poses, [], [])
    graph.anchors[21:] = [2, 5, 20]
    graph.marginals = {0: np.eye(3)}
    for offset in (0, 1):
        for r in pairwise:
            a, b = r.nodes
            graph.pairwise.append(dataclasses.replace(r, nodes=(2 * a + offset, 2 * b + offset)))
        for n in nscan:
            graph.nscan.append(dataclasses.replace(n, nodes=tuple(2 * i + offset for i in n.nodes)))
    return graph


def test_each_part_comes_to_its_minimum_and_keeps_its_first_keyframe():
    graph = graph_in_parts()
    before = graph.poses.copy()
    assert [part.keyframes.tolist() for part in components(graph)] == [
        list(range(0, 20, 2)),
        list(range(1, 20, 2)),
        [20],
    ]
    result = optimise_graph(graph)
    assert result.converged
    np.testing.assert_allclose(relative(graph.poses[[0, 1, 20]], before[[0, 1, 20]]), 0, atol=1e-12)
    # Both rings have the same relations, so the same shape and half of the energy each.
    shapes = [relative(graph.poses[offset:20:2], graph.poses[offset]) for offset in (0, 1)]
    np.testing.assert_allclose(relative(*shapes), 0, atol=1e-6)
    truth, pairwise, nscan = mixed_ring(10, noise=1.0)
    alone = graph_of(truth, pairwise, nscan)
    assert result.energy == pytest.approx(2 * optimise_graph(alone).energy, rel=1e-9)


def test_attached_scans_move_along_and_old_marginals_go():
    graph = graph_in_parts()
    before = graph.poses.copy()
    optimise_graph(graph)
    anchors = graph.anchors[21:]
    assert np.abs(graph.poses[anchors[:2]] - before[anchors[:2]]).max(axis=1).min() > 0.01
    np.testing.assert_allclose(
        relative(relative(graph.poses[21:], graph.poses[anchors]), relative(before[21:], before[anchors])),
        0,
        atol=1e-12,
    )
    assert graph.marginals == {}


def test_the_result_is_the_same_each_time_and_again_from_itself():
    first, second = graph_in_parts(), graph_in_parts()
    result = optimise_graph(first)
    again = optimise_graph(second)
    assert (result.energy, result.iterations, result.converged) == (
        again.energy,
        again.iterations,
        again.converged,
    )
    assert first.poses.tobytes() == second.poses.tobytes()
    assert optimise_graph(first).energy == pytest.approx(result.energy, rel=1e-12)
    np.testing.assert_allclose(relative(first.poses, second.poses), 0, atol=1e-6)


def test_wild_poses_do_not_matter():
    truth, pairwise, nscan = mixed_ring(40, noise=1.0)
    near, far = graph_of(truth, pairwise, nscan), graph_of(disturbed(truth, 30.0), pairwise, nscan)
    assert optimise_graph(far).energy == pytest.approx(optimise_graph(near).energy, rel=1e-9)
    np.testing.assert_allclose(relative(far.poses, near.poses), 0, atol=1e-5)


@pytest.mark.parametrize(("count", "turn_noise", "seed"), [(600, 0.3, 5), (1000, 0.35, 3), (1000, 0.35, 4)])
def test_a_town_that_the_chordal_start_folds_wrong_is_unfolded(count, turn_noise, seed):
    """As low as from the true poses; the minimum next to the chordal start is a tenth above that."""
    truth, pairwise = streets(count, 300, turn_noise, seed)
    energy = energy_of(truth, pairwise, [])
    lowest = optimise_poses(energy, truth, StopOptions(1000)).energy
    given = [truth[0]]
    for relation in pairwise[: count - 1]:
        given.append(compose(given[-1], relation.measurement))
    assert optimise_poses(energy, chordal_start(energy, np.array(given))).energy > 1.1 * lowest
    result = optimise_graph(graph_of(np.array(given), pairwise, []))
    assert result.converged
    assert result.energy == pytest.approx(lowest, rel=1e-9)


def test_a_graph_of_one_keyframe_without_relations_stays():
    graph = graph_of(np.array([[1.0, 2.0, 3.0]]), [], [])
    result = optimise_graph(graph)
    assert (result.energy, result.iterations, result.converged) == (0.0, 0, True)
    np.testing.assert_array_equal(graph.poses, [[1.0, 2.0, 3.0]])
