"""The other forms in which pose graphs of the plane are written: TORO, poses in space, keys of GTSAM."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError
from nscan_cli.graph.io.g2o import parse_g2o, write_g2o
from nscan_cli.graph.io.json_graph import parse_graph, write_graph
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.graph_solver import StopOptions
from nscan_cli.graph.optimise.whole_graph import WholeGraphOptions, optimise_graph
from nscan_cli.poses import Array, relative
from tests.graph.schema import validate
from tests.graph.simulated_relations import disturbed, graph_of, pairwise_relations, ring, ring_edges

UPPER = np.triu_indices(6)
GTSAM_X0 = 120 << 56
"""120 is the letter x."""


def ring_graph(noise: float = 1.0) -> Graph:
    truth = ring(12)
    edges = [*ring_edges(12), (2, 8), (3, 9)]
    relations = pairwise_relations(truth, edges, np.random.default_rng(2), noise)
    return graph_of(disturbed(truth, 0.05), relations, [])


def translated(vertex: Callable[[list[str]], str], edge: Callable[[list[str]], str]) -> str:
    """The ring as g2o, its lines made anew of their fields."""
    lines = []
    for line in write_g2o(ring_graph()).decode().splitlines():
        tag, *fields = line.split()
        lines.append(vertex(fields) if tag == "VERTEX_SE2" else edge(fields) if tag == "EDGE_SE2" else line)
    return "\n".join(lines)


def quaternion(angle: str, sign: float = 1.0) -> str:
    half = float(angle) / 2
    return f"0.0 -0.0 {float(sign * np.sin(half))!r} {float(sign * np.cos(half))!r}"


def edge_in_space(fields: list[str]) -> str:
    """With four times θ's information for qz, and twice what couples it; z, roll and pitch are sure."""
    i, j, x, y, angle = fields[:5]
    xx, xy, xa, yy, ya, aa = map(float, fields[5:])
    information = np.diag([0.0, 0.0, 1e4, 7e3, 9e3, 0.0])
    information[np.ix_([0, 1, 5], [0, 1, 5])] = [[xx, xy, 2 * xa], [xy, yy, 2 * ya], [2 * xa, 2 * ya, 4 * aa]]
    numbers = " ".join(repr(float(entry)) for entry in information[UPPER])
    return f"EDGE_SE3:QUAT {i} {j} {x} {y} 0 {quaternion(angle, -1.0)} {numbers}"


def edge_of_toro(fields: list[str]) -> str:
    i, j, x, y, angle, xx, xy, xa, yy, ya, aa = fields
    return f"EDGE2 {i} {j} {x} {y} {angle} {xx} {xy} {yy} {aa} {xa} {ya}"


IN_SPACE = translated(lambda f: f"VERTEX_SE3:QUAT {f[0]} {f[1]} {f[2]} 0 {quaternion(f[3])}", edge_in_space)
TORO = translated(lambda fields: " ".join(["VERTEX2", *fields]), edge_of_toro)


@pytest.mark.parametrize("text", [IN_SPACE, TORO], ids=["SE3", "TORO"])
def test_it_is_the_graph_that_g2o_has_of_the_plane(text: str):
    wanted = parse_g2o(write_g2o(ring_graph()), "plane.g2o")
    graph = parse_g2o(text.encode(), "other.g2o")
    assert graph.provenance["skipped"] == {}
    np.testing.assert_allclose(relative(graph.poses, wanted.poses), 0, atol=1e-12)
    assert len(graph.pairwise) == len(wanted.pairwise) == 14
    for edge, other in zip(graph.pairwise, wanted.pairwise, strict=True):
        assert (edge.nodes, edge.origin) == (other.nodes, other.origin)
        np.testing.assert_allclose(relative(edge.measurement, other.measurement), 0, atol=1e-12)
        np.testing.assert_allclose(edge.information, other.information, rtol=1e-9, atol=1e-6)
    assert optimise_graph(graph).energy == pytest.approx(optimise_graph(wanted).energy, rel=1e-9)


def test_gtsam_agrees_on_poses_in_space(tmp_path: Path):
    """At our minimum, with g2o's own error for what it reads, it has our energy, and nothing moves it."""
    gtsam = pytest.importorskip("gtsam", reason="gtsam is not installed: pip install nscan-cli[test]")
    graph = parse_g2o(IN_SPACE.encode(), "space.g2o")
    optimum = optimise_graph(graph, WholeGraphOptions(StopOptions(1000, 1e-9)))
    path = tmp_path / "space.g2o"
    path.write_text(IN_SPACE)
    factors, values = gtsam.readG2o(str(path), True)

    def energy(poses: Array) -> float:
        at = [gtsam.Pose3(gtsam.Rot3.Yaw(angle), np.array([x, y, 0.0])) for x, y, angle in poses.tolist()]
        total = 0.0
        for k in range(factors.size()):
            factor = factors.at(k)
            i, j = factor.keys()
            off = factor.measured().between(at[i].between(at[j]))
            q = off.rotation().toQuaternion()
            vector = np.array([q.x(), q.y(), q.z()]) * np.sign(q.w())
            # GTSAM puts rotation first, and reads the matrix as it is written.
            error = np.concatenate([vector, off.translation()])
            total += error @ factor.noiseModel().information() @ error
        return total

    assert (factors.size(), values.size()) == (14, 12)
    assert optimum.energy > 1
    # sin(θ/2) and θ/2 differ in the third order.
    assert energy(graph.poses) == pytest.approx(optimum.energy, rel=1e-3)
    rng = np.random.default_rng(0)
    for _ in range(20):
        assert energy(graph.poses + 0.01 * rng.normal(size=graph.poses.shape)) > energy(graph.poses)


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("VERTEX_SE3:QUAT 1 0 0 0.5 0 0 0 1", "not planar: z 0.5 m, qx 0, qy 0; give a graph of the plane"),
        ("VERTEX_SE3:QUAT 1 0 0 0 0.01 0 0 0.99995", "the pose is not planar: z 0 m, qx 0.01"),
        (
            "EDGE_SE3:QUAT 0 0 1 0 0 0 0 0 1" + " 1" * 21,
            "the edge joins vertex 0 with itself",
        ),
        ("EDGE_SE3:QUAT 0 1 1 0 0 0 0.7071 0 0.7071" + " 0" * 21, "not planar: z 0 m, qx 0, qy 0.707"),
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 0", "the quaternion has the length 0 instead of 1; mend"),
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 nan 1", "a number is not finite"),
        ("VERTEX_SE3:QUAT 1 0 0 0", "VERTEX_SE3:QUAT has 4 values instead of 8"),
        ("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1" + " inf" * 21, "a number is not finite"),
        ("VERTEX_SE2 18446744073709551616 0 0 0", "'18446744073709551616' is not a vertex id"),
        ("VERTEX_SE2 x72057594037927936 0 0 0", "'x72057594037927936' is not a vertex id"),
        ("EDGE_SE2 0 x3 0 0 0 1 0 0 1 0 1", re.escape(f"there is no vertex {GTSAM_X0 + 3} (x3)")),
        ("EDGE2 0 1 0 0 0 1 0 1 -1 0 0\nVERTEX2 1 0 0 0", "the information matrix has a negative eigenvalue"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(line: str, problem: str):
    with pytest.raises(InputDataError, match=rf"^graph\.g2o, line 2: .*{problem}"):
        parse_g2o(f"VERTEX_SE2 0 0 0 0\n{line}\n".encode(), "graph.g2o")


def test_six_decimals_of_nothing_are_nothing():
    """z, roll and pitch of a robot on the floor, as printf and single precision leave them."""
    text = "VERTEX_SE3:QUAT 4 1 2 -0.000001 4e-08 -0.000001 0.707107 0.707107\n"
    graph = parse_g2o(text.encode(), "graph.g2o")
    np.testing.assert_allclose(graph.poses, [[1, 2, np.pi / 2]], atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.sets(st.integers(0, 2**64 - 1), min_size=2, max_size=5))
def test_keys_of_64_bits_come_back_from_both_forms(found: set[int]):
    chosen = sorted(found)
    edges = "".join(f"EDGE_SE2 {a} {b} 1 0 0 4 0 0 4 0 9\n" for a, b in itertools.pairwise(chosen))
    text = "".join(f"VERTEX_SE2 {key} {row} 0 0\n" for row, key in enumerate(chosen)) + edges
    graph = parse_g2o(text.encode(), "graph.g2o")
    data = write_graph(graph)
    validate(json.loads(data))
    back = parse_graph(data, "graph.json")
    assert write_graph(back) == data
    for each in (graph, back):
        lines = [line.split() for line in write_g2o(each).decode().splitlines()]
        assert [int(fields[1]) for fields in lines if fields[0] == "VERTEX_SE2"] == chosen
        ends = [(int(fields[1]), int(fields[2])) for fields in lines if fields[0] == "EDGE_SE2"]
        assert ends == list(itertools.pairwise(chosen))
    small = chosen[-1] <= 2**53
    assert graph.scans.tolist() == (chosen if small else list(range(len(chosen))))
    assert (b'"vertex"' in data) is not small


def test_a_byte_order_mark_and_line_ends_of_windows_cost_no_vertex():
    text = "\ufeffVERTEX_SE2 0 0 0 0\r\nVERTEX_SE2 1 1 0 0\r\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\r\n"
    graph = parse_g2o(text.encode(), "graph.g2o")
    assert (graph.scans.tolist(), graph.provenance["skipped"]) == ([0, 1], {})


def test_a_symbol_of_gtsam_is_its_key():
    text = (
        f"VERTEX_SE2 x1 1 0 0\nVERTEX_SE2 {GTSAM_X0} 0 0 0\n"
        f"EDGE_SE2 x0 {GTSAM_X0 + 1} 1 0 0 1 0 0 1 0 1\nFIX x0\n"
    )
    graph = parse_g2o(text.encode(), "graph.g2o")
    assert graph.vertices == [GTSAM_X0, GTSAM_X0 + 1]
    assert graph.pairwise[0].nodes == (0, 1)
    assert write_g2o(graph).decode().splitlines()[0] == "VERTEX_SE2 8646911284551352320 0.0 0.0 0.0"


def test_gtsam_reads_the_keys_that_are_written(tmp_path: Path):
    gtsam = pytest.importorskip("gtsam", reason="gtsam is not installed: pip install nscan-cli[test]")
    text = f"VERTEX_SE2 {GTSAM_X0} 0 0 0\nVERTEX_SE2 {GTSAM_X0 + 1} 1 0 0\nEDGE_SE2 x0 x1 1 0 0 1 0 0 1 0 1\n"
    path = tmp_path / "graph.g2o"
    path.write_bytes(write_g2o(parse_g2o(text.encode(), "graph.g2o")))
    factors, values = gtsam.readG2o(str(path), False)
    assert factors.size() == 1
    assert list(values.keys()) == [gtsam.symbol("x", 0), gtsam.symbol("x", 1)]


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (
            lambda text: text.replace('"vertex":"1844', '"vertex":"9944'),
            r"nodes\[1\]: 'vertex' is not a number",
        ),
        (
            lambda text: text.replace('"vertex":"1844', '"vertex":"-844'),
            r"nodes\[1\]: 'vertex' is not a number",
        ),
        (
            lambda text: text.replace('"vertex":"7",', ""),
            "nodes: 'vertex' is not unique to each of them",
        ),
        (
            lambda text: text.replace('"vertex":"7"', f'"vertex":"{2**64 - 1}"'),
            "nodes: 'vertex' is not unique to each of them",
        ),
    ],
)
def test_wrong_keys_in_json_are_refused(change: Callable[[str], str], problem: str):
    graph = parse_g2o(f"VERTEX_SE2 7 0 0 0\nVERTEX_SE2 {2**64 - 1} 0 0 0\n".encode(), "graph.g2o")
    text = write_graph(graph).decode()
    assert change(text) != text
    with pytest.raises(InputDataError, match=problem):
        parse_graph(change(text).encode(), "graph.json")
