"""`nscan-cli nscan` as a user meets it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_fields import JsonRecord
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.symmetric_matrices import from_upper_triangle
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.relations.registry import relation_of
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.poses import compose, relative
from tests.cli.documents import assert_error_line, document_and_notices
from tests.data import CORRIDOR_LOG, OFFICE_LOG, data_file
from tests.matching.problems import errors

SPEC = "2000-2024:8"
SCANS = [2000, 2008, 2016, 2024]
KEYS = [
    "format", "version", "units", "provenance", "relation", "covariance", "energy", "gradient_norm",
    "decrement", "iterations", "evaluations", "unsettled_stages", "searched", "converged", "reason",
    "pairs", "overlap", "weakest", "left_out",
]  # fmt: skip


matched = partial(document_and_notices, "nscan")


def graph_of(log: LaserLog, scans: list[int], relations: list[Pairwise] | None = None) -> Graph:
    """A graph of true poses; all nodes are keyframes."""
    assert log.truth is not None
    source = {"name": log.source.name, "sha256": log.source.sha256, "bytes": log.source.bytes}
    return Graph(
        scans=np.array(scans),
        stamps=[log.stamps[scan] for scan in scans],
        poses=log.truth[scans],
        odometry=None,
        anchors=np.arange(len(scans)),
        pairwise=relations or [],
        provenance={"inputs": [source], "parameters": {}},
    )


def assert_true(document: dict[str, Any], log: LaserLog, metres: float = 0.03) -> None:
    assert log.truth is not None
    off = errors(np.array(document["relation"]["poses"]), log.truth[document["relation"]["scans"]])
    assert np.hypot(off[:, 0], off[:, 1]).max() < metres


def test_the_document(capsys, office):
    document, said = matched(capsys, OFFICE_LOG, "--scans", SPEC)
    assert list(document) == KEYS
    assert (document["format"], document["version"]) == ("nscan-joint-match", "1.0")
    relation = relation_of(JsonRecord(document["relation"], "relation"), "scans")
    assert isinstance(relation, NScan)
    assert (relation.nodes, relation.fixed, relation.origin) == (tuple(SCANS), 0, "nscan")
    assert_true(document, office)
    values = np.linalg.eigvalsh(relation.hessian)
    assert np.abs(values[:3]).max() < 1e-3 * values[3]
    covariance = from_upper_triangle(document["covariance"], 9)
    np.testing.assert_allclose(covariance @ relation.hessian[3:, 3:], np.eye(9), atol=0.05)
    assert document["pairs"] == [[i, j] for i in SCANS for j in SCANS if i != j]
    assert len(document["overlap"]) == 4
    assert len(document["weakest"]) == 4
    assert all(0 < weakest["sigma"] < 0.02 for weakest in document["weakest"])
    assert all(abs(weakest["direction"]) <= np.pi / 2 for weakest in document["weakest"])
    assert document["provenance"]["parameters"]["pairs"] == "overlap"
    assert relation.score == min(document["overlap"]) > 0.6
    assert (document["converged"], document["reason"], document["left_out"]) == (True, None, [])
    assert document["provenance"]["inputs"][0]["sha256"] == office.source.sha256
    assert [line.split()[0] for line in said] == ["scans", "overlap", "match"]
    assert said[0] == "scans    4 of 4, matched in 12 pairs"
    assert said[2].startswith("match    converged, ")


def test_fig_3_of_the_paper_is_known_in_every_direction(capsys):
    """Scans 45, 117 and 150 are 1, 2 and 3 of the figure: jointly no direction is left open."""
    document, _ = matched(capsys, CORRIDOR_LOG, "--scans", "45,117,150", "--prior", "none")
    assert document["converged"]
    covariance = from_upper_triangle(document["covariance"], 6)
    assert np.sqrt(covariance[[0, 1, 3, 4], [0, 1, 3, 4]]).max() < 0.1
    assert_true(document, read_log(CORRIDOR_LOG), 0.15)


def test_gauges_and_the_fixed_scan(capsys, office):
    arguments = (OFFICE_LOG, "--scans", SPEC, "--fixed", "2016")
    free, _ = matched(capsys, *arguments)
    fixed, _ = matched(capsys, *arguments, "--gauge", "fixed")
    for document in (free, fixed):
        assert document["relation"]["fixed"] == 2016
        assert_true(document, office)
    covariance = from_upper_triangle(free["covariance"], 9)
    assert office.odometry is not None
    start = relative(office.odometry[2016], office.odometry[2000])
    np.testing.assert_allclose(fixed["relation"]["poses"][2], start, atol=1e-8)
    off = errors(np.array(free["relation"]["poses"]), np.array(fixed["relation"]["poses"]))
    # Where they stop at a cell's border the two differ, by less than matching knows.
    sigmas = np.sqrt(np.diag(covariance)).reshape(-1, 3)
    assert (np.abs(np.delete(off, 2, axis=0)) < 0.5 * sigmas).all()


def test_without_odometry(capsys, office):
    document, said = matched(capsys, OFFICE_LOG, "--scans", "2000-2003", "--no-odometry")
    assert said[0] == "no odometry: initial identity, prior none"
    assert_true(document, office, 0.05)


def test_starts_from_a_graph_and_from_a_trajectory(tmp_path, capsys, office):
    assert office.truth is not None
    graph, tum = tmp_path / "graph.json", tmp_path / "path.tum"
    graph.write_bytes(write_graph(graph_of(office, [0, *SCANS])))
    # Stamps of another clock tick: the nearest in time is taken.
    stamps = [f"{float(office.stamps[scan]) + 0.01:.3f}" for scan in SCANS]
    tum.write_bytes(write_tum(stamps, office.truth[SCANS]))
    for path in (graph, tum):
        document, _ = matched(
            capsys, OFFICE_LOG, "--scans", SPEC, "--initial", str(path), "--prior", "none", "--gauge", "fixed"
        )
        assert_true(document, office)
        np.testing.assert_allclose(document["relation"]["poses"][0], office.truth[2000], atol=1e-8)
        assert [source["name"] for source in document["provenance"]["inputs"]] == [
            office.source.name,
            path.name,
        ]
        assert document["provenance"]["parameters"]["initial"] == path.name


def test_relations_of_a_graph_are_priors(tmp_path, capsys, office):
    """A relation that is sure of a place 5 cm off pulls the scan there; one to another scan does nothing."""
    assert office.truth is not None
    step = relative(office.truth[2008], office.truth[2000]) + np.array([0.05, 0, 0])
    relations = [
        Pairwise((1, 2), step, np.eye(3) * 1e8, "track"),
        Pairwise((0, 1), np.array([9.0, 9, 0]), np.eye(3) * 1e8, "track"),
    ]
    path = tmp_path / "graph.json"
    path.write_bytes(write_graph(graph_of(office, [0, *SCANS], relations)))
    document, said = matched(
        capsys, OFFICE_LOG, "--scans", "2000,2008", "--initial", str(path), "--prior", str(path)
    )
    poses = np.array(document["relation"]["poses"])
    np.testing.assert_allclose(relative(poses[1], poses[0]), step, atol=2e-3)
    assert len(document["provenance"]["inputs"]) == 2
    assert "warning" not in said[0]
    _, said = matched(capsys, OFFICE_LOG, "--scans", "2016,2024", "--prior", str(path))
    assert "has no relation between these scans" in said[0]


def test_a_graph_gives_bounds_where_no_relation_joins_two_scans(tmp_path, capsys, office):
    """The way from 2000 to 2008 leads over 2004; both steps are sure of a way 2 cm longer."""
    assert office.truth is not None
    truth = office.truth[[2000, 2004, 2008]]
    steps = relative(truth[1:], truth[:-1]) + np.array([0.02, 0, 0])
    relations = [Pairwise((at, at + 1), step, np.eye(3) * 1e8, "track") for at, step in enumerate(steps)]
    graph = graph_of(office, [2000, 2004, 2008], relations)
    graph.poses = np.array([truth[0], compose(truth[0], steps[0]), compose(truth[0], compose(*steps))])
    path = tmp_path / "graph.json"
    path.write_bytes(write_graph(graph))
    document, said = matched(capsys, OFFICE_LOG, "--scans", "2000,2008", "--prior", str(path))
    poses = np.array(document["relation"]["poses"])
    np.testing.assert_allclose(relative(poses[1], poses[0]), compose(*steps), atol=2e-3)
    assert "warning" not in said[0]


def test_pairs_are_those_that_were_asked_for(capsys, office):
    arguments = (OFFICE_LOG, "--scans", "0-360:40")
    used = {}
    for kind in ("all", "visible", "overlap"):
        document, _ = matched(capsys, *arguments, "--pairs", kind)
        assert document["provenance"]["parameters"]["pairs"] == kind
        used[kind] = {tuple(pair) for pair in document["pairs"]}
    assert len(used["all"]) == 90
    assert used["visible"] < used["all"]
    assert used["overlap"] < used["all"]
    assert used["visible"] != used["overlap"]


def test_the_same_bytes_every_time(tmp_path):
    for name in ("a", "b"):
        outputs = ["-o", str(tmp_path / f"{name}.json"), "--plot", str(tmp_path / f"{name}.png")]
        assert run(["nscan", CORRIDOR_LOG, "--scans", "20-100:20", "-q", *outputs]) == 0
    for kind in ("json", "png"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ([], 2, "--scans"),
        (["--scans", "4"], 2, "only one scan"),
        (["--scans", "1,x"], 2, "'x' is not of the form"),
        (["--scans", ""], 2, "is not of the form"),
        (["--scans", "1,1"], 2, "scan 1 twice"),
        (["--scans", "1,9999"], 2, "no scan 9999"),
        (["--scans", "1,2", "--fixed", "3"], 2, "--fixed 3"),
        (["--scans", "1,2", "--gauge", "loose"], 2, "--gauge"),
        (["--scans", "1,2", "--pairs", "some"], 2, "--pairs"),
        (["--scans", "1,2", "--no-odometry", "--prior", "odometry"], 2, "--prior none"),
        (["--scans", "1,2", "--initial", "none.tum"], 66, "none.tum"),
        (["--scans", "1,2", "--initial", "none"], 66, "none: no such file"),
        (["--scans", "1,2", "--prior", "identity"], 66, "identity: no such file"),
        (["--scans", "1,2", "--prior", "path.tum"], 2, "has no relations"),
        (["--scans", "1,2", "--initial", "path.tum"], 65, "path.tum: has no pose of scan 1"),
        (["--scans", "1,2", "--initial", "graph.json"], 65, "graph.json: has no pose of scan 2"),
        (["--scans", "1,2", "--initial", "other.json"], 65, "is not a graph of office.log.gz"),
        (["--scans", "1,2", "--initial", "text"], 65, "text, line 1"),
        (["--scans", "1,2", "--max-range", "0.4"], 65, "scan 1 has 0 usable beams"),
        (["--scans", "1,2", "-o", "no/such.json"], 73, "does not exist"),
    ],
)
def test_mistakes_are_one_line(tmp_path, monkeypatch, capsys, office, arguments, code, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "path.tum").write_text("1 0 0 0 0 0 0 1\n")
    (tmp_path / "text").write_text("neither of the two\n")
    graph = graph_of(office, [0, 1])
    (tmp_path / "graph.json").write_bytes(write_graph(graph))
    graph.provenance["inputs"][0]["sha256"] = "0" * 64
    (tmp_path / "other.json").write_bytes(write_graph(graph))
    assert run(["nscan", OFFICE_LOG, *arguments]) == code
    assert_error_line(capsys, said)


def test_standard_input_is_one_input(capsys):
    assert run(["nscan", "-", "--scans", "1,2", "--initial", "-"]) == 2
    assert "one input only" in capsys.readouterr().err


@pytest.mark.logs
def test_a_real_log(capsys):
    """Ten scans of Intel along 5 m of way, from odometry: they fall together."""
    log = str(data_file("intel.log.gz"))
    document, _ = matched(capsys, log, "--scans", "3000-3090:10")
    assert document["converged"]
    assert document["left_out"] == []
    assert min(document["overlap"]) > 0.8
