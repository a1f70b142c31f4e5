"""The terms kept while a graph grows, against those of the same relations alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.term_cache import TermCache, TermColumns
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.graph.relations.base import Relation
from tests.graph.simulated_relations import disturbed, graph_of, mixed_ring

SIZE = 12
TRUTH, PAIRWISE, NSCAN = mixed_ring(SIZE, noise=1.0)
RELATIONS: list[Relation] = [*PAIRWISE, *NSCAN]


def assert_same(found: TermColumns, wanted: TermColumns) -> None:
    for name in ("starts", "members", "local", "fixed", "weights"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    for k, size in enumerate(9 * np.diff(wanted.starts) ** 2):
        here, there = (each.hessians[each.hessian_starts[k] :][:size] for each in (found, wanted))
        np.testing.assert_array_equal(here, there)


@given(st.lists(st.permutations(range(len(RELATIONS))), min_size=1, max_size=5), st.data())
@settings(max_examples=50, deadline=None)
def test_columns_are_those_of_the_relations_asked_for(orders, data):
    """Whatever was asked for before, in whatever order, at whatever places."""
    terms = TermCache()
    for order in orders:
        chosen = [RELATIONS[k] for k in order[: data.draw(st.integers(0, len(order)))]]
        positions = np.array(data.draw(st.permutations(range(SIZE))))
        assert_same(terms.columns(chosen, positions), TermCache().columns(chosen, positions))


def test_an_energy_does_not_change_when_the_graph_grows():
    poses, terms, positions = disturbed(TRUTH, 0.3), TermCache(), np.arange(SIZE)
    first = GraphEnergy(SIZE, PAIRWISE, positions, terms=terms)
    before = first.evaluate(poses, exact=True)
    both = GraphEnergy(SIZE, RELATIONS, positions, terms=terms)
    after = first.evaluate(poses, exact=True)
    np.testing.assert_array_equal(after.hessian, before.hessian)
    np.testing.assert_array_equal(after.terms, before.terms)
    alone = GraphEnergy(SIZE, RELATIONS, positions)
    for found, wanted in zip(both.evaluate(poses, True), alone.evaluate(poses, True), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_a_relation_in_the_place_of_another_is_one_of_its_own():
    terms, positions = TermCache(), np.arange(SIZE)
    terms.columns(RELATIONS, positions)
    other = replace(PAIRWISE[0], measurement=PAIRWISE[0].measurement + 0.5)
    relations = [other, *RELATIONS[1:]]
    assert_same(terms.columns(relations, positions), TermCache().columns(relations, positions))


def test_a_node_without_a_place_is_an_error_and_not_the_last_pose():
    positions = np.arange(SIZE)
    positions[PAIRWISE[2].nodes[1]] = -1
    with pytest.raises(
        ValueError, match=f"a relation has node {PAIRWISE[2].nodes[1]}, which is not a keyframe"
    ):
        GraphEnergy(SIZE, RELATIONS, positions)


def test_a_scan_that_is_attached_to_a_keyframe_is_in_no_energy():
    """Where one is made of it all the same, which no reader of files does, it is no silent wrong result."""
    relations = [replace(PAIRWISE[0], nodes=nodes) for nodes in ((0, 1), (0, 2))]
    graph = graph_of(TRUTH, relations, [])
    optimise_graph(graph)
    graph.anchors[1] = 0
    with pytest.raises(ValueError, match="a relation has node 1, which is not a keyframe"):
        optimise_graph(graph)
