from __future__ import annotations

import itertools

import numpy as np
import pytest

from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.graph.relative_covariance import AttachmentOptions, RelativePoses
from nscan_cli.poses import Array, compose, relative, relative_jacobians
from tests.graph.simulated_relations import dense_matrix, each_pair_once, energy_of, graph_of, mixed_ring

CHOSEN = (0, 3, 4, 11, 25)
ATTACHED = np.array([AttachmentOptions().sigma, AttachmentOptions().sigma, AttachmentOptions().angle_sigma])


@pytest.fixture(scope="module")
def ring() -> Graph:
    graph = graph_of(*mixed_ring(30, noise=1.0))
    optimise_graph(graph)
    return graph


def dense(graph: Graph, held: int) -> Array:
    """(K, 3, K, 3) covariance of the keyframes' poses with one of them held."""
    energy = energy_of(graph.poses, *each_pair_once(graph.pairwise, graph.nscan), held)
    information = 0.5 * dense_matrix(energy, energy.evaluate(graph.poses, exact=False).hessian)
    count = len(graph)
    free = np.delete(np.arange(count), held)
    whole = np.zeros((count, 3, count, 3))
    inverse = np.linalg.inv(information).reshape(count - 1, 3, count - 1, 3)
    whole[np.ix_(free, np.arange(3), free, np.arange(3))] = inverse
    return whole


def test_it_is_the_marginal_of_the_dense_inverse_with_the_first_of_the_two_held(ring):
    between = RelativePoses(ring, CHOSEN)
    for a, b in itertools.permutations(CHOSEN, 2):
        relation = between.relation(a, b)
        assert relation is not None
        assert relation.nodes == (a, b)
        np.testing.assert_array_equal(relation.measurement, relative(ring.poses[b], ring.poses[a]))
        by_b, _ = relative_jacobians(ring.poses[b], ring.poses[a])
        expected = by_b @ dense(ring, a)[b, :, b] @ by_b.T
        found = np.linalg.inv(relation.information)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-10)


def test_one_relation_between_two_is_given_back():
    information = np.array([[400.0, 30, 5], [30, 900, -40], [5, -40, 2500]])
    poses = np.array([[1.0, 2, 0.5], [2.0, 1, 2.5]])
    step = relative(poses[1], poses[0])
    graph = graph_of(poses, [Pairwise((0, 1), step, information, "track")], [])
    relation = RelativePoses(graph, (0, 1)).relation(0, 1)
    assert relation is not None
    np.testing.assert_allclose(relation.information, information, rtol=1e-9)


def test_an_attached_node_moves_with_its_keyframe(ring):
    """Its covariance by moving all poses of the dense one's scatter, and ATTACHED."""
    offset = np.array([0.5, -0.3, 0.7])
    graph = graph_of(ring.poses, ring.pairwise, ring.nscan)
    graph.scans = np.arange(31)
    graph.stamps = [str(k) for k in range(31)]
    graph.poses = np.vstack([ring.poses, compose(ring.poses[4], offset)])
    graph.anchors = np.append(np.arange(30), 4)
    between = RelativePoses(graph, (11, 30))
    relation = between.relation(11, 30)
    assert relation is not None
    covariance = dense(ring, 11)[4, :, 4]

    def seen(keyframe: Array) -> Array:
        return relative(compose(keyframe, offset), ring.poses[11])

    step = 1e-6
    jacobian = np.stack(
        [(seen(ring.poses[4] + unit) - seen(ring.poses[4] - unit)) / (2 * step) for unit in step * np.eye(3)],
        axis=1,
    )
    expected = jacobian @ covariance @ jacobian.T + np.diag(ATTACHED**2)
    np.testing.assert_allclose(np.linalg.inv(relation.information), expected, rtol=1e-5, atol=1e-9)
    with_its_own = RelativePoses(graph, (4, 30)).relation(4, 30)
    assert with_its_own is not None
    np.testing.assert_allclose(with_its_own.measurement, offset, atol=1e-12)
    np.testing.assert_allclose(with_its_own.information, np.diag(ATTACHED**-2), rtol=1e-6)


def test_nodes_that_no_relations_connect_have_none(ring):
    graph = graph_of(np.vstack([ring.poses, np.zeros((3, 3))]), list(ring.pairwise), ring.nscan)
    graph.pairwise.append(Pairwise((30, 31), np.ones(3), np.eye(3), "track"))
    # 32 hangs on 3, but may slide.
    graph.pairwise.append(Pairwise((3, 32), np.ones(3), np.diag([1.0, 0.0, 50.0]), "loop"))
    between = RelativePoses(graph, (3, 5, 30, 31, 32))
    assert between.relation(3, 30) is None
    assert between.relation(3, 32) is None
    assert between.relation(5, 3) is not None
    relation = between.relation(31, 30)
    assert relation is not None
    assert np.linalg.eigvalsh(relation.information)[0] > 0
