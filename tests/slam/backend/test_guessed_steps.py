"""What was guessed stays known in a saved graph, and its sigma when it is refined."""

from __future__ import annotations

import copy
import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.backend.guessed_steps import guesses_of
from nscan_cli.slam.backend.resume import resume
from nscan_cli.slam.log_to_graph import map_log
from nscan_cli.slam.options import SlamOptions
from tests.simulation.scenes import bare_corridor, corridor_and_room


@functools.cache
def without_end() -> LaserLog:
    """A bare corridor whose odometry ends half-way."""
    log = bare_corridor().record(4).log()
    assert log.odometry is not None
    odometry = log.odometry.copy()
    odometry[len(log) // 2 :] = np.nan
    return replace(log, odometry=odometry, odometry_path=None)


@functools.cache
def saved() -> Graph:
    """Its graph as it comes back from its file."""
    _, graph = map_log(without_end(), ReadingOptions(), SlamOptions(), 1, lambda *_counts: None)
    return parse_graph(write_graph(graph), "saved.json")


def worst_sigma(graph: Graph) -> float:
    return max(float(np.sqrt(np.linalg.eigvalsh(each[:2, :2])[-1])) for each in graph.marginals.values())


def test_the_graph_says_where_the_way_was_guessed():
    variances, keyframes = guesses_of(saved()), saved().keyframes
    guessed = keyframes[1:][variances[:, 0] > 0.0]
    assert len(guessed) > 5
    assert guessed.min() > 0.45 * len(without_end())
    assert worst_sigma(saved()) > 3.0


def test_a_refined_graph_is_no_surer_of_it():
    graph = copy.deepcopy(saved())
    optimise_graph(graph)
    again = resume(graph, without_end(), np.arange(len(without_end())))
    assert worst_sigma(again) == pytest.approx(worst_sigma(saved()), rel=0.4)
    np.testing.assert_array_equal(guesses_of(again), guesses_of(saved()))
    # Without what the graph says it would be.
    silent = copy.deepcopy(saved())
    del silent.provenance["guessed_steps"]
    assert not guesses_of(silent).any()


def test_nothing_was_guessed_where_scans_tell_the_way():
    log = corridor_and_room().record(3).log()
    _, graph = map_log(log, ReadingOptions(), SlamOptions(), 1, lambda *_counts: None)
    assert "guessed_steps" not in graph.provenance
    assert not guesses_of(graph).any()


@pytest.mark.parametrize(
    "wrong",
    [5, [5], [{"from": 0, "to": 99999}], [{"from": [], "to": 1}], [{"from": 0, "to": 1, "along": "far"}]],
)
def test_what_is_no_guess_is_refused(wrong):
    graph = copy.deepcopy(saved())
    first, second = graph.keyframes[:2].tolist()
    if isinstance(wrong, list) and isinstance(wrong[0], dict) and "along" in wrong[0]:
        wrong = [wrong[0] | {"from": first, "to": second}]
    graph.provenance["guessed_steps"] = wrong
    with pytest.raises(ValueError, match="guessed_steps"):
        guesses_of(graph)
