from __future__ import annotations

import copy
import io
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.graph.io.json_fields import JsonRecord, MalformedError
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.relations.registry import relation_of, relation_record
from nscan_cli.poses import wrap
from tests.graph.schema import schema, validate
from tests.graph.small_graph import graphs, small_graph

# π rounds up to 3.141592654 and would leave (−π, π]; −π is π; 7 rad is 7 − 2π = 0.716814692820.
GOLDEN = """\
{"$schema":"urn:nscan-cli:pose-graph:1.0",
"format":"nscan-pose-graph",
"version":"1.0",
"units":{"length":"m","angle":"rad","time":"s"},
"provenance":{"tool":{"name":"nscan-cli","version":"0.1.0"},"inputs":[{"name":"a.log","sha256":"%s","bytes":12}],"parameters":{"every":1}},
"nodes":[
{"id":0,"scan":0,"stamp":"976052896.784509","pose":[0.0,0.0,0.0],"odometry":[0.0,0.0,0.0],"keyframe":true},
{"id":1,"scan":5,"stamp":"976052897.100000","pose":[1.0,0.25,3.141592653],"odometry":[1.1,0.2,0.5],"keyframe":false,"attached":0},
{"id":2,"scan":7,"stamp":"976052898.5","pose":[2.0,0.5,0.1],"odometry":[2.1,0.4,0.716814693],"keyframe":true}
],
"relations":[
{"id":0,"type":"pairwise","nodes":[0,2],"measurement":[2.0,0.5,0.1],"information":[100.0,0.0,0.0,50.0,0.0,400.0],"origin":"track","score":0.75},
{"id":1,"type":"nscan","nodes":[2,0],"poses":[[2.0,0.5,0.1],[0.0,0.0,0.0]],"hessian":[1.0,0.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0,0.0,0.0,1.0,0.0,1.0],"fixed":0,"origin":"nscan","score":0.333333}
],
"loops":[
{"nodes":[0,2],"accepted":false,"reason":"ambiguous: \\"twice\\"","score":0.5}
],
"marginals":[
{"node":2,"covariance":[0.01,0.0,0.0,0.02,0.0,0.00123457]}
]}
""" % ("0" * 64)


def test_a_graph_has_these_bytes():
    assert write_graph(small_graph()).decode() == GOLDEN


def test_a_graph_without_relations_or_provenance_is_a_document_too():
    graph = small_graph()
    graph.pairwise, graph.nscan, graph.loops, graph.marginals, graph.provenance = [], [], [], {}, {}
    document = json.loads(write_graph(graph))
    assert document["relations"] == document["loops"] == document["marginals"] == []
    assert document["provenance"]["tool"]["name"] == "nscan-cli"
    validate(document)


@settings(max_examples=50, deadline=None)
@given(graphs())
def test_what_is_written_reads_back_and_writes_the_same_again(graph: Graph):
    data = write_graph(graph)
    back = parse_graph(data, "graph.json")
    assert write_graph(back) == data
    assert back.stamps == graph.stamps
    np.testing.assert_array_equal(back.scans, graph.scans)
    np.testing.assert_array_equal(back.anchors, graph.anchors)
    assert_same_poses(back.poses, graph.poses)
    assert (back.odometry is None) == (graph.odometry is None)
    for relation, original in zip(back.pairwise, graph.pairwise, strict=True):
        assert relation.nodes == original.nodes
        assert_same_poses(relation.measurement[None], original.measurement[None])
        np.testing.assert_allclose(relation.information, original.information, rtol=5e-6)
    for nscan, original_nscan in zip(back.nscan, graph.nscan, strict=True):
        assert (nscan.nodes, nscan.fixed) == (original_nscan.nodes, original_nscan.fixed)
        assert_same_poses(nscan.poses, original_nscan.poses)
        np.testing.assert_allclose(nscan.hessian, original_nscan.hessian, rtol=5e-6)


@settings(max_examples=25, deadline=None)
@given(graphs())
def test_every_graph_written_is_valid_and_has_no_signed_zero(graph: Graph):
    data = write_graph(graph)
    validate(json.loads(data))
    assert b"-0.0," not in data
    assert b"-0.0]" not in data
    for node in json.loads(data)["nodes"]:
        assert -np.pi < node["pose"][2] <= np.pi


def test_a_node_whose_odometry_is_missing_has_none():
    graph = small_graph()
    assert graph.odometry is not None
    graph.odometry[1] = np.nan
    document = json.loads(write_graph(graph))
    validate(document)
    assert ["odometry" in node for node in document["nodes"]] == [True, False, True]
    back = parse_graph(write_graph(graph), "graph.json")
    assert back.odometry is not None
    np.testing.assert_array_equal(np.isnan(back.odometry[:, 0]), [False, True, False])
    np.testing.assert_allclose(back.odometry[[0, 2], :2], graph.odometry[[0, 2], :2])


def test_a_number_that_is_not_finite_is_never_written():
    graph = small_graph()
    graph.poses[1, 0] = np.nan
    with pytest.raises(ValueError, match="the poses of the graph: a number is not finite"):
        write_graph(graph)


def test_the_largest_log_stays_under_ten_megabytes():
    """17,480 scans as of mit-killian, 700 nScan relations of 10 scans, 4,000 pairwise ones."""
    rng = np.random.default_rng(1)
    count = 17480
    keyframes = np.arange(0, count, 10)
    graph = Graph(
        scans=np.arange(count),
        stamps=[f"{1031745836.957 + 0.44 * k:.6f}" for k in range(count)],
        poses=rng.normal(scale=100, size=(count, 3)),
        odometry=np.round(rng.normal(scale=100, size=(count, 3)), 6),
        anchors=np.repeat(keyframes, 10)[:count],
        pairwise=[
            Pairwise((int(a), int(b)), rng.normal(size=3), np.cov(rng.normal(size=(3, 9))), "track", 0.5)
            for a, b in zip(np.resize(keyframes[:-1], 4000), np.resize(keyframes[1:], 4000), strict=True)
        ],
    )
    for k in range(700):
        nodes = tuple(keyframes[k : k + 10].tolist())
        graph.nscan.append(NScan(nodes, rng.normal(size=(10, 3)), rng.normal(size=(30, 30)), 0, "nscan"))
    graph.marginals = {int(node): np.cov(rng.normal(size=(3, 9))) for node in keyframes}
    assert len(write_graph(graph)) < 10e6


def test_the_schema_is_a_schema():
    jsonschema.Draft202012Validator.check_schema(schema())
    assert schema()["$id"] == json.loads(GOLDEN)["$schema"]


Change = Callable[[dict[str, Any]], Any]

# What both the schema and the reader refuse: the change to the document, and words of the message.
WRONG: list[tuple[Change, str]] = [
    (lambda d: d.update(format="geojson"), "document: 'format' is not 'nscan-pose-graph'"),
    (lambda d: d.update(version="2.0"), "'version' is '2.0'"),
    (lambda d: d.update(units={"length": "cm"}), "'units' is not"),
    (lambda d: d.pop("loops"), "'loops' is missing"),
    (lambda d: d["provenance"].pop("tool"), "provenance: 'tool' is missing"),
    (lambda d: d["provenance"]["inputs"][0].pop("sha256"), r"inputs\[0\]: 'sha256' is missing"),
    (lambda d: d.update(nodes=[]), "nodes: there are none"),
    (lambda d: d.update(nodes={}), "'nodes' is not a list"),
    (lambda d: d["nodes"].__setitem__(1, 5), r"nodes\[1\]: is not a JSON object"),
    (lambda d: d["nodes"][1].update(pose=[0, 1]), r"nodes\[1\]: 'pose' is not a pose of three"),
    (lambda d: d["nodes"][1].update(pose=[0, 1, "2"]), "'pose' is not a pose"),
    (lambda d: d["nodes"][1].update(pose=[0, 1, True]), "'pose' is not a pose"),
    (lambda d: d["nodes"][1].update(stamp=976.5), "'stamp' is not a string"),
    (lambda d: d["nodes"][1].update(stamp="noon"), "'stamp' is not a time"),
    (lambda d: d["nodes"][1].update(scan=-1), "'scan' is not an integer"),
    (lambda d: d["nodes"][1].update(scan=1.5), "'scan' is not an integer"),
    (lambda d: d["nodes"][1].update(keyframe="no"), "'keyframe' is not true or false"),
    (lambda d: d["nodes"][1].pop("attached"), "'attached' is missing"),
    (lambda d: d["nodes"][0].update(attached=2), "a keyframe cannot be 'attached'"),
    (lambda d: d["relations"][0].update(type=7), r"relations\[0\]: 'type' is not one of pairwise, nscan"),
    (lambda d: d["relations"][0].update(nodes=[0]), "distinct integers"),
    (lambda d: d["relations"][0].update(nodes=[2, 2]), "distinct integers"),
    (lambda d: d["relations"][0].update(information=[1] * 5), "upper triangle of a 3 × 3 matrix: 6 finite"),
    (lambda d: d["relations"][0].update(origin="guess"), "'origin' is not one of"),
    (lambda d: d["relations"][1].pop("hessian"), "'hessian' is missing"),
    (lambda d: d["loops"][0].update(reason=None), r"loops\[0\]: 'reason' is not a string"),
    (lambda d: d["marginals"][0].update(covariance=[]), "'covariance' is not"),
]
# What a schema cannot say.
WRONG_IN_ITSELF: list[tuple[Change, str]] = [
    (
        lambda d: d["relations"][0].update(type="edge"),
        r"relations\[0\]: 'type' is not one of pairwise, nscan",
    ),
    (lambda d: d["nodes"][1].update(pose=[0, 1, 10**400]), "'pose' is not a pose"),
    (lambda d: d["nodes"][1].update(stamp="1e999"), "'stamp' is not a time"),
    (lambda d: d["nodes"][2].update(id=3), r"nodes\[2\]: 'id' is 3, but ids count up from 0, here 2"),
    (lambda d: d["nodes"][2].update(scan=5), "'scan' is not greater"),
    (lambda d: d["nodes"][1].update(attached=1), r"nodes\[1\]: 'attached' is the node itself"),
    (lambda d: d["nodes"][1].update(attached=9), "'attached' is 9, which is not a keyframe"),
    (lambda d: d["relations"][1].update(id=0), r"relations\[1\]: 'id' is 0"),
    (lambda d: d["relations"][0].update(nodes=[0, 1]), "node 1 is not a keyframe of this graph"),
    (lambda d: d["relations"][0].update(nodes=[0, 9]), "node 9 is not a keyframe"),
    (lambda d: d["relations"][0].update(information=[-1, 0, 0, 1, 0, 1]), "positive semi-definite"),
    (
        lambda d: d["relations"][1].update(hessian=(-5.0 * np.eye(6)[np.triu_indices(6)]).tolist()),
        r"relations\[1\]: 'hessian' is not positive semi-definite: it has a negative eigenvalue, -5 beside",
    ),
    (
        lambda d: d["marginals"][0].update(covariance=[1, 2, 0, 1, 0, 1]),
        r"marginals\[0\]: 'covariance' is not positive semi-definite",
    ),
    (lambda d: d["relations"][1].update(nodes=[0, 2, 1]), "list of 3 poses"),
    (lambda d: d["relations"][1]["hessian"].append(0), "6 × 6 matrix: 21 finite numbers"),
    (lambda d: d["relations"][1].update(fixed=1), "'fixed' is 1, which is not one of its nodes"),
    (lambda d: d["marginals"].append(d["marginals"][0]), "node 2 has a covariance already"),
]


@pytest.mark.parametrize(("change", "problem"), WRONG + WRONG_IN_ITSELF)
def test_a_wrong_document_is_refused_with_its_place(change: Change, problem: str):
    with pytest.raises(InputDataError, match=problem) as error:
        parse_graph(json.dumps(changed(change)).encode(), "floor.json")
    assert str(error.value).startswith("floor.json: ")
    assert str(error.value).endswith("mend it, or write the graph again with nscan-cli slam")


def test_what_a_hessian_has_for_pose_c_does_not_count():
    """The gauge is in it there, or anything: fᵗHf has no part of pose c, nodes[1] of this relation."""
    hessian = np.diag([1.0, 1.0, 1.0, -7.0, -7.0, -7.0])
    upper = hessian[np.triu_indices(6)].tolist()
    data = json.dumps(changed(lambda d: d["relations"][1].update(hessian=upper))).encode()
    (relation,) = parse_graph(data, "floor.json").nscan
    np.testing.assert_array_equal(relation.hessian, hessian)


@pytest.mark.parametrize("change", [change for change, _ in WRONG])
def test_the_schema_refuses_a_wrong_document(change: Change):
    with pytest.raises(jsonschema.ValidationError):
        validate(changed(change))


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "g.json, line 1: is empty"),
        (b'{"format":\n"nscan-pose-graph"\n"version"}', "g.json, line 3: not JSON"),
        (b"# Dear all,\nfirst", "g.json: is of an unknown kind; give a graph in JSON, as nscan-cli slam"),
        (b"FLASER 1 2.0 0 0 0 0 0 0 1.0 host 1.0\n" * 3, r"g.json: is a log \(CARMEN text\); give a graph"),
        (b"\x1f\x8b\x08\x00\x00", "g.json: is compressed by gzip; give a graph"),
        (b"VERTEX_SE2 0 0 0 0\n", r"g.json: is a pose graph \(g2o or TORO\); give a graph in JSON"),
        (b'{"format":NaN}', "not JSON: it has a number NaN"),
        (b"\xff\xfe\xfd\x00\x01", "is binary data of an unknown kind"),
        (b"[" * 100_000, "not JSON"),
        (b"[]", "document: is not a JSON object"),
        (b"{}", "'format' is not"),
    ],
)
def test_what_is_no_graph_is_refused(data: bytes, problem: str):
    with pytest.raises(InputDataError, match=problem):
        parse_graph(data, "g.json")


def test_a_graph_is_read_from_a_file_and_from_standard_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "graph.json"
    path.write_text(GOLDEN)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(GOLDEN.encode())))
    assert write_graph(load_graph(str(path))).decode() == write_graph(load_graph("-")).decode() == GOLDEN


def test_a_missing_file_and_a_folder_say_what_to_do(tmp_path: Path):
    with pytest.raises(InputMissingError, match=r"nowhere\.json: no such file; check the path"):
        load_graph(str(tmp_path / "nowhere.json"))
    with pytest.raises(InputMissingError, match="is a folder; name a file in it"):
        load_graph(str(tmp_path))


def test_an_nscan_result_names_scans_instead_of_nodes():
    relation = NScan((140, 120), np.zeros((2, 3)), np.eye(6), 1, "nscan")
    record = relation_record(relation, key="scans")
    assert (record["scans"], record["fixed"]) == ([140, 120], 120)
    assert relation_of(JsonRecord(record, "relation"), key="scans").nodes == (140, 120)
    with pytest.raises(MalformedError, match="relation: 'nodes' is missing"):
        relation_of(JsonRecord(record, "relation"))


def changed(change: Change) -> dict[str, Any]:
    document: dict[str, Any] = copy.deepcopy(json.loads(GOLDEN))
    change(document)
    return document


def assert_same_poses(poses: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(poses[:, :2], expected[:, :2], atol=1e-9)
    np.testing.assert_allclose(wrap(poses[:, 2] - expected[:, 2]), 0, atol=2e-9)
