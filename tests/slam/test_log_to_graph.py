"""A log mapped, as `slam` and `nightly` do it."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter

import numpy as np
import pytest

from nscan_cli import __version__
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.model import Graph, Loop
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import path_lengths
from nscan_cli.slam.frontend.scan_batch import SCANS_PER_BATCH
from nscan_cli.slam.log_to_graph import GraphCounts, map_log, slam_options
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.systematic_error import SystematicError, without_systematic_error
from tests.data import CORRIDOR_LOG
from tests.simulation.scenes import office


def test_what_a_user_does_not_choose_has_its_default():
    assert slam_options() == SlamOptions()
    options = slam_options(5, "pairwise", loops=False)
    assert (options.nscan.max_scans, options.relations, options.nscan.loops) == (5, "pairwise", False)
    same = dataclasses.replace(options.nscan, max_scans=SlamOptions().nscan.max_scans, loops=True)
    assert same == SlamOptions().nscan


def test_the_graph_says_what_it_was_made_from_and_the_report_how_far_it_is():
    reading = ReadingOptions(every=2)
    log, told = read_log(CORRIDOR_LOG, reading), []
    state, graph = map_log(log, reading, slam_options(6), 1, lambda *done: told.append(done))
    provenance = graph.provenance
    assert provenance["tool"] == {"name": "nscan-cli", "version": __version__}
    assert provenance["inputs"][0]["sha256"] == log.source.sha256
    assert provenance["parameters"]["reading"]["every"] == 2
    assert provenance["parameters"]["slam"]["nscan"]["max_scans"] == 6
    done, keyframes, loops = zip(*told, strict=True)
    assert done == (*range(SCANS_PER_BATCH, len(log), SCANS_PER_BATCH), len(log))
    assert (np.diff(keyframes) >= 0).all()
    assert (np.diff(loops) >= 0).all()
    assert keyframes[-1] == len(state.keyframes) == len(graph.keyframes)
    assert 0 <= loops[-1] <= len(graph.loops)
    again = map_log(log, reading, slam_options(6), 2, lambda *_state: None)[1]
    assert write_graph(again) == write_graph(graph)


def test_a_drive_that_is_mapped_again_is_reported_again_and_said():
    log = without_systematic_error(office().record(1).log(), SystematicError(1.15, 0.0))
    told = []
    state, graph = map_log(log, ReadingOptions(), slam_options(), 1, lambda *done: told.append(done[0]))
    again = [k for k, (before, after) in enumerate(itertools.pairwise(told)) if after <= before]
    assert len(again) >= 1
    assert all(told[k] == len(log) for k in [*again, -1])
    assert any("too long everywhere, by the map" in said for said in graph.provenance["notices"])
    assert state.recorded.odometry is not None
    assert log.odometry is not None
    ways = [path_lengths(poses)[-1] for poses in (log.odometry, state.recorded.odometry)]
    assert ways[0] / ways[1] == pytest.approx(1.15, abs=0.02)


def test_loops_are_counted_by_their_verdicts():
    loops = [Loop((0, 3), True, "", 0.9), Loop((0, 4), False, "a", 0.1), Loop((1, 4), False, "a", 0.1),
             Loop((1, 5), False, "b", 0.1)]  # fmt: skip
    graph = Graph(np.arange(3), list("012"), np.zeros((3, 3)), None, np.array([0, 0, 2]), loops=loops)
    assert GraphCounts.of(graph) == GraphCounts(2, 0, 0, 1, Counter({"a": 2, "b": 1}))
