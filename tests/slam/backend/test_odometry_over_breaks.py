"""Odometry over a break of the track counts where loops agree with it."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.poses import relative
from nscan_cli.slam.backend.finish import finish_graph
from nscan_cli.slam.backend.odometry_over_breaks import believe_odometry_over_breaks
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.state import SlamState
from tests.slam.keyframe_drives import round_scene
from tests.slam.mapped_logs import Mapped, mapped
from tests.slam.trouble_cases import ROUND


@pytest.fixture(scope="module")
def carried() -> Mapped:
    return mapped(ROUND["carried by 5 m"](round_scene().record(5).log()).log)


def believed(run: Mapped, off: float) -> SlamState:
    """The state where odometry says what the map says, but for a step over the break that is `off`, m."""
    state, odometry = copy.copy(run.state), run.graph.poses.copy()
    odometry[state.breaks[0] :, 0] += off
    state.odometry = odometry
    believe_odometry_over_breaks(state)
    return state


def test_what_loops_contradict_is_switched_off(carried):
    """The odometry stood while the robot was carried by 5 m."""
    assert len(carried.state.breaks) == 1
    assert carried.state.odometry_relations == []
    assert believed(carried, 10.0).odometry_relations == []


def test_what_they_agree_with_is_in_the_graph(carried):
    state = believed(carried, 0.0)
    (relation,) = state.odometry_relations
    before, after = relation.nodes
    assert before < state.breaks[0] == after
    assert relation.origin == "odometry"
    (said,) = (text for text in notices(state) if "tracking broke" in text)
    assert said.endswith("odometry and loops agree how it moved there")
    graph = finish_graph(state)
    np.testing.assert_allclose(graph.poses, carried.graph.poses, atol=0.01)
    step = relative(graph.poses[after], graph.poses[before])
    np.testing.assert_allclose(relation.measurement, step, atol=0.01)
    graph.provenance = carried.graph.provenance
    again = parse_graph(write_graph(graph), "graph.json")
    assert [pair.nodes for pair in again.pairwise if pair.origin == "odometry"] == [relation.nodes]


def test_without_loops_over_the_break_odometry_tells_nothing(carried):
    state = copy.copy(carried.state)
    state.odometry = carried.graph.poses
    row = state.breaks[0]
    for each in ("matched_pairs", "nscan_relations"):
        kept = [one for one in getattr(state, each) if max(one.nodes) < row or min(one.nodes) >= row]
        setattr(state, each, kept)
    believe_odometry_over_breaks(state)
    assert state.odometry_relations == []
    state = copy.copy(carried.state)
    state.odometry = None
    believe_odometry_over_breaks(state)
    assert state.odometry_relations == []
