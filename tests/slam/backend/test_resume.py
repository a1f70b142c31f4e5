"""A saved graph refined again from its log, without tracking."""

from __future__ import annotations

import copy
import functools

import numpy as np
import pytest

from nscan_cli.files.provenance import as_parameters
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.model import Graph, Loop
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array
from nscan_cli.slam.backend.resume import can_refine, options_of, resume
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.verification import AMBIGUOUS
from nscan_cli.slam.options import Relations, SlamOptions
from tests.logs.excerpts import excerpt, truth_of
from tests.slam.mapped_logs import mapped, office_log, position_rmse


@functools.cache
def tenth() -> LaserLog:
    """Every tenth scan of the office, a round with loops."""
    return excerpt(office_log(), slice(None, None, 10))


@functools.cache
def saved(relations: Relations = "both") -> Graph:
    """Its graph as it comes back from its file."""
    graph = mapped(tenth(), SlamOptions(relations=relations)).graph
    return parse_graph(write_graph(graph), "saved.json")


def rmse(poses: Array) -> float:
    return position_rmse(poses, truth_of(tenth()))


def refined(graph: Graph, log: LaserLog | None = None) -> Graph:
    """As `slam --from` does it."""
    graph = copy.deepcopy(graph)
    optimise_graph(graph)
    log = log or tenth()
    return resume(graph, log, np.searchsorted(log.numbers, graph.scans))


@pytest.mark.parametrize("relations", ["both", "nscan", "pairwise"])
def test_a_graph_that_is_refined_already_stays_as_good(relations: Relations):
    before, after = saved(relations), refined(saved(relations))
    assert rmse(after.poses) < 1.2 * rmse(before.poses)
    # Seen from the scans, the same matches: some keyframes more or less at the edge of a radius.
    assert len(after.nscan) == pytest.approx(len(before.nscan), abs=3 + 0.05 * len(before.nscan))
    assert len(after.pairwise) == pytest.approx(len(before.pairwise), abs=3 + 0.05 * len(before.pairwise))
    np.testing.assert_array_equal(after.anchors, before.anchors)
    assert after.stamps == before.stamps
    assert after.provenance == before.provenance
    assert set(after.marginals) == set(after.keyframes.tolist())
    parse_graph(write_graph(after), "again.json")


def test_matches_that_are_gone_are_made_again():
    """Only the chain of tracking is left, with its drift."""
    bare = copy.deepcopy(saved())
    bare.nscan, bare.loops = [], []
    optimise_graph(bare)
    after = refined(bare)
    assert len(after.nscan) > 0.8 * len(saved().nscan)
    assert any(loop.accepted for loop in after.loops)
    assert rmse(after.poses) < 0.5 * rmse(bare.poses)
    assert rmse(after.poses) < 1.5 * rmse(saved().poses)


def test_the_same_graph_every_time():
    assert write_graph(refined(saved())) == write_graph(refined(saved()))


def test_the_parameters_are_those_of_the_graph():
    options = SlamOptions(nscan=NScanOptions(max_scans=5, widenings=(0.1, 1.0)), relations="nscan")
    graph = copy.deepcopy(saved())
    graph.provenance["parameters"]["slam"] = as_parameters(options)
    graph = parse_graph(write_graph(graph), "saved.json")
    assert options_of(graph) == options
    assert max(len(relation.nodes) for relation in refined(graph).nscan) == 5
    # A graph of another version may lack some parameters, and have others.
    graph.provenance["parameters"]["slam"] = {"nscan": {"max_scans": 4}, "other": 1}
    assert options_of(graph) == SlamOptions(nscan=NScanOptions(max_scans=4))


def test_scans_that_the_graph_does_not_have_are_left_out():
    """The log is read whole: the graph says which of its scans are nodes."""
    expected = refined(saved())
    np.testing.assert_array_equal(refined(saved(), office_log()).poses, expected.poses)
    np.testing.assert_array_equal(expected.scans, 10 * np.arange(252))


def test_verdicts_of_the_search_stay():
    graph = copy.deepcopy(saved())
    keyframes = graph.keyframes.tolist()
    searched = Loop((keyframes[0], keyframes[-1]), False, AMBIGUOUS, 0.7)
    graph.loops = [searched, Loop((keyframes[1], keyframes[-1]), True, "", 0.9)]
    found = refined(graph).loops
    assert found[-1] == searched
    assert len(found) > 2


def test_what_slam_did_not_make_cannot_be_refined():
    assert can_refine(saved())
    foreign = copy.deepcopy(saved())
    foreign.provenance = {"inputs": [], "parameters": {}}
    assert not can_refine(foreign)
    edited = copy.deepcopy(saved())
    edited.anchors = edited.anchors.copy()
    edited.anchors[-1] = 0
    assert not can_refine(edited)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_graphs_of_a_few_scans(count: int):
    log = excerpt(tenth(), slice(0, count))
    graph = mapped(log).graph
    after = refined(graph, log)
    np.testing.assert_allclose(after.poses, graph.poses, atol=1e-3)
