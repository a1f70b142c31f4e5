import numpy as np
import pytest

from nscan_cli.graph.marginal_covariances import marginal_covariances
from nscan_cli.graph.model import turned_graph
from nscan_cli.poses import relative
from tests.graph.small_graph import small_graph


def test_a_quarter_turn():
    graph = small_graph()
    turned = turned_graph(graph, np.pi / 2)
    assert turned.poses[1] == pytest.approx([-0.25, 1.0, -np.pi / 2])
    assert turned.marginals[2] == pytest.approx(np.diag([0.02, 0.01, 0.0012345678]), abs=1e-12)
    assert graph.poses[1] == pytest.approx([1.0, 0.25, -np.pi])


def test_what_is_relative_stays_and_covariances_agree_with_the_relations():
    graph = small_graph()
    graph.marginals = marginal_covariances(graph)
    turned = turned_graph(graph, 0.7)
    assert relative(turned.poses[1:], turned.poses[:-1]) == pytest.approx(
        relative(graph.poses[1:], graph.poses[:-1])
    )
    assert turned.relations == graph.relations
    anew = marginal_covariances(turned)
    assert set(anew) == set(turned.marginals)
    for node, covariance in anew.items():
        assert turned.marginals[node] == pytest.approx(covariance, abs=1e-12)
