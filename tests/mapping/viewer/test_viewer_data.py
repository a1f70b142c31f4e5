from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.model import Graph, Loop, Pairwise
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.mapping.viewer import viewer_data as module
from nscan_cli.mapping.viewer.viewer_data import viewer_data
from tests.mapping.handmade_logs import half_circle
from tests.mapping.viewer.unpack import ranges_of, unpack

BOUNDS = (0.0, 0.0, 4.0, 3.0)
POSES = np.array([[0.5, 0.25, 0.0], [1.0, 0.25, 0.5], [2.0, 0.5, 1.0]])
RANGES = np.tile(np.array([1.0, 12.34, np.nan, 300.5, 0.02, 655.35, 700.0] + [5.0] * 174), (3, 1))


def graph() -> Graph:
    return Graph(
        scans=np.array([0, 2, 5]),
        stamps=["10.0", "10.5", "12.0"],
        poses=POSES,
        odometry=None,
        anchors=np.array([0, 0, 2]),
        pairwise=[Pairwise((0, 2), np.array([1.5, 0.25, 1.0]), np.eye(3), "track")],
        loops=[Loop((0, 2), True, "", 0.5), Loop((2, 0), False, "did not converge", 0.25)],
        marginals={2: np.diag([0.04, 0.09, 0.01])},
        provenance={"inputs": [{"name": "a.log", "sha256": "0", "bytes": 1}],
                    "notices": ["tracking broke at scan 5; the motion to there is unknown"]},
    )  # fmt: skip


def test_the_page_has_what_the_graph_has():
    data = unpack(viewer_data(graph(), BOUNDS, None))
    assert data["bounds"] == list(BOUNDS)
    assert data["poses"].reshape(-1, 3) == pytest.approx(POSES)
    assert data["times"].tolist() == [0.0, 0.5, 2.0]
    assert data["numbers"].tolist() == [0, 2, 5]
    assert data["keyframes"].tolist() == [0, 2]
    assert data["pairwise"].tolist() == [0, 2]
    assert data["nscan"].tolist() == []
    assert data["loops"] == [
        {"nodes": [0, 2], "accepted": True, "reason": "", "score": 0.5},
        {"nodes": [2, 0], "accepted": False, "reason": "did not converge", "score": 0.25},
    ]
    assert [notice["places"] for notice in data["notices"]] == [[[2, 2]]]
    assert ["log", "a.log"] in data["facts"]
    assert data["scanNodes"].tolist() == []


def test_an_ellipse_has_its_long_axis_first():
    first, second = unpack(viewer_data(graph(), BOUNDS, None))["sigma"].reshape(2, 3)
    assert np.isnan(first).all()
    assert second[:2] == pytest.approx([0.3, 0.2])
    assert abs(second[2]) == pytest.approx(np.pi / 2)


def test_ranges_come_back_to_a_centimetre():
    log = half_circle(RANGES)
    nodes = np.arange(3)
    data = unpack(viewer_data(graph(), BOUNDS, (log, nodes, nodes)))
    assert data["beamAngles"].reshape(-1, 2) == pytest.approx(
        np.column_stack([log.angle_min, log.angle_increment]), abs=1e-6
    )
    # What is missing, or too far for two bytes, is no return.
    expected = np.where(np.isfinite(RANGES) & (RANGES < 655.36), RANGES, 0.0)
    assert ranges_of(data) == pytest.approx(expected, abs=0.0051)


def test_of_a_long_log_every_nth_scan_is_there(monkeypatch):
    monkeypatch.setattr(module, "MAX_BEAMS", 2 * 181)
    nodes = np.arange(3)
    data = unpack(viewer_data(graph(), BOUNDS, (half_circle(RANGES), nodes, nodes)))
    assert data["scanNodes"].tolist() == [0, 2]
    assert ranges_of(data).shape == (2, 181)


def test_loops_of_a_graph_without_verdicts_are_its_relations():
    other = graph()
    other.loops = []
    other.pairwise = [Pairwise((0, 2), np.array([1.5, 0.25, 1.0]), np.eye(3), "loop")]
    (loop,) = unpack(viewer_data(other, BOUNDS, None))["loops"]
    assert (loop["nodes"], loop["accepted"]) == ([0, 2], True)


def test_the_same_bytes_every_time():
    nodes = np.arange(3)
    scans = (half_circle(RANGES), nodes, nodes)
    assert viewer_data(graph(), BOUNDS, scans) == viewer_data(graph(), BOUNDS, scans)


def test_a_turning_laser_has_the_times_of_its_beams():
    nodes = np.arange(3)
    times = BeamTimes(np.array([0.0, -0.05, 0.01]), np.full(3, 0.0005))
    log = dataclasses.replace(half_circle(RANGES), beam_times=times)
    data = unpack(viewer_data(graph(), BOUNDS, (log, nodes, nodes)))
    assert data["beamTimes"].reshape(-1, 2) == pytest.approx(np.column_stack(times))
    assert "beamTimes" not in unpack(viewer_data(graph(), BOUNDS, (half_circle(RANGES), nodes, nodes)))
