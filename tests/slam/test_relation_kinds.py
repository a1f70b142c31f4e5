"""What the graph is made of: pairwise relations, nScan relations or both; with loops or without."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.whole_graph import components, optimise_graph
from nscan_cli.slam.options import Relations, SlamOptions
from tests.slam.mapped_logs import mapped_office


def chain(graph: Graph) -> list[tuple[int, int]]:
    """Each keyframe and the next."""
    return list(itertools.pairwise(graph.keyframes.tolist()))


# Measured: 6.3, 6.2 and 7.5 mm.
@pytest.mark.parametrize(("relations", "bound"), [("both", 0.01), ("nscan", 0.01), ("pairwise", 0.013)])
def test_the_error_of_the_office(relations: Relations, bound: float):
    assert mapped_office(True, relations).rmse() < bound


def test_nscan_keeps_of_the_chain_what_nothing_else_holds_together():
    graph = mapped_office(True, "nscan").graph
    kept = [relation.nodes for relation in graph.pairwise]
    joined = {
        pair for pair in chain(graph) if any(set(pair) <= set(relation.nodes) for relation in graph.nscan)
    }
    assert len(joined) > 0.85 * len(chain(graph))
    assert kept == [pair for pair in chain(graph) if pair not in joined]
    optimise_graph(graph)
    assert len(components(graph)) == 1


def test_pairwise_has_the_chain_and_single_matches_and_no_joint_one():
    graph = mapped_office(True, "pairwise").graph
    assert graph.nscan == []
    links, matches = graph.pairwise[: len(chain(graph))], graph.pairwise[len(chain(graph)) :]
    assert [relation.nodes for relation in links] == chain(graph)
    assert len(matches) > 3 * len(graph.keyframes)
    assert {relation.origin for relation in matches} == {"track", "loop"}
    assert len({relation.nodes for relation in matches}) == len(matches)
    options = SlamOptions().nscan
    for relation in matches:
        assert set(relation.nodes) <= set(graph.keyframes.tolist())
        assert options.min_overlap <= relation.score <= 1
    centres = [relation.nodes[1] for relation in matches]
    assert max(centres.count(node) for node in set(centres)) <= options.max_scans - 1


def test_pairwise_loops_have_one_verdict_for_each_centre():
    """And another one where a place was searched and not found."""
    office = mapped_office(True, "pairwise")
    graph, refused = office.graph, office.state.detector.refused()
    centres = [loop.nodes[1] for loop in graph.loops[: len(graph.loops) - len(refused)]]
    assert graph.loops[len(centres) :] == refused
    assert centres == sorted(set(centres))
    accepted = [loop for loop in graph.loops if loop.accepted]
    assert len(accepted) > 40
    assert all(loop.score >= SlamOptions().nscan.min_overlap for loop in accepted)
    for loop in graph.loops:
        assert loop.accepted or loop.reason


# Measured: 241 of 184 keyframes, of which 58 are nScan relations, and 918.
@pytest.mark.parametrize(("relations", "least"), [("both", 1.2), ("pairwise", 4.2)])
def test_without_loops_no_relation_joins_different_visits(relations: Relations, least: float):
    office = mapped_office(True, relations, loops=False)
    paths = {keyframe.row: keyframe.tracked.path for keyframe in office.state.keyframes.list}
    recent = SlamOptions().nscan.visit_path
    pairwise, nscan = office.graph.pairwise, office.graph.nscan
    found: list[tuple[tuple[int, ...], int]] = [(relation.nodes, relation.nodes[1]) for relation in pairwise]
    found += [(relation.nodes, relation.nodes[relation.fixed]) for relation in nscan]
    assert len(found) > least * len(office.graph.keyframes)
    for nodes, centre in found:
        assert np.abs([paths[node] - paths[centre] for node in nodes]).max() <= recent
    assert office.graph.loops == []
    assert {relation.origin for relation in pairwise} == {"track"}
    assert {relation.origin for relation in nscan} <= {"nscan"}


def test_without_loops_drift_remains():
    """Twice as far off and more, over the 243 m."""
    assert mapped_office(True, loops=False).rmse() > 2 * mapped_office(True).rmse()
