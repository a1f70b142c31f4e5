from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from nscan_cli.errors import InputDataError
from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.relations.pairwise_marginals import pairwise_marginals
from nscan_cli.poses import compose, relative, rotated_information, wrap
from tests.data import data_file
from tests.graph.small_graph import graphs, small_graph

SQUARE = """\
# ids need not count up, nor be in order
VERTEX_SE2 30 1 0 1.5707963267948966
VERTEX_SE2 10 0 0 0
FIX 10
EDGE_SE2 10 30 1 0 1.5707963267948966 4 0 0 9 0 16
VERTEX_XY 99 1 2
VERTEX_SE2 40 1 1 0
EDGE_SE2 30 40 1 0 -1.5707963267948966 1 0 0 1 0 1
EDGE_SE2 40 10 -1 -1 0 1 0.5 0 1 0 1
"""


def energy(graph: Graph) -> float:
    """Σ ΔᵗC⁻¹Δ of eqs. (16) and (17), pairwise relations only."""
    total = 0.0
    for relation in graph.pairwise:
        a, b = relation.nodes
        error = relative(graph.poses[b], graph.poses[a]) - relation.measurement
        error[2] = wrap(error[2])
        total += float(error @ relation.information @ error)
    return total


def energy_of_g2o(text: str, poses: dict[int, np.ndarray]) -> float:
    """Σ eᵗΩe as g2o has it, with homogeneous matrices: e = components of Z⁻¹ (X_i⁻¹ X_j)."""

    def matrix(x: float, y: float, angle: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])

    total = 0.0
    for line in text.splitlines():
        if not line.startswith("EDGE_SE2"):
            continue
        i, j = (int(field) for field in line.split()[1:3])
        dx, dy, angle, xx, xy, xa, yy, ya, aa = (float(field) for field in line.split()[3:])
        E = np.linalg.inv(matrix(dx, dy, angle)) @ np.linalg.inv(matrix(*poses[i])) @ matrix(*poses[j])
        e = np.array([E[0, 2], E[1, 2], np.arctan2(E[1, 0], E[0, 0])])
        total += e @ np.array([[xx, xy, xa], [xy, yy, ya], [xa, ya, aa]]) @ e
    return total


def read(tmp_path: Path, text: str) -> Graph:
    path = tmp_path / "graph.g2o"
    path.write_text(text)
    return load_graph(str(path))


def test_vertices_become_keyframes_in_order_of_their_ids(tmp_path: Path):
    graph = read(tmp_path, SQUARE)
    assert graph.scans.tolist() == [10, 30, 40]
    assert graph.stamps == ["0", "1", "2"]
    assert graph.keyframes.tolist() == [0, 1, 2]
    np.testing.assert_allclose(graph.poses, [[0.0, 0.0, 0.0], [1.0, 0.0, np.pi / 2], [1.0, 1.0, 0.0]])
    assert [relation.nodes for relation in graph.pairwise] == [(0, 1), (1, 2), (2, 0)]
    assert [relation.origin for relation in graph.pairwise] == ["odometry", "odometry", "loop"]
    assert graph.provenance["skipped"] == {"VERTEX_XY": 1}
    assert graph.provenance["inputs"][0]["name"] == "graph.g2o"


def test_information_is_turned_from_the_frame_of_the_measurement(tmp_path: Path):
    # The first edge turns by 90°: what g2o weighs along the measured x lies along y of vertex 10.
    np.testing.assert_allclose(
        read(tmp_path, SQUARE).pairwise[0].information, np.diag([9, 4, 16]), atol=1e-12
    )


@pytest.mark.logs
@pytest.mark.parametrize(
    ("name", "nodes", "edges"), [("intel", 1728, 2512), ("csail", 1045, 1172), ("mit", 808, 827)]
)
def test_the_energy_of_a_real_graph_is_that_of_g2o(name: str, nodes: int, edges: int):
    path = data_file(f"{name}.g2o")
    graph = load_graph(str(path))
    assert (len(graph), len(graph.pairwise)) == (nodes, edges)
    poses = dict(zip(graph.scans.tolist(), graph.poses, strict=True))
    expected = energy_of_g2o(path.read_text(), poses)
    assert expected > 100
    assert energy(graph) == pytest.approx(expected, rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(graphs(all_keyframes=True))
def test_what_is_written_reads_back_with_the_same_energy(
    tmp_path_factory: pytest.TempPathFactory, graph: Graph
):
    graph.nscan = []
    text = write_g2o(graph).decode()
    back = read(tmp_path_factory.mktemp("g2o"), text)
    np.testing.assert_array_equal(back.poses, graph.poses)
    np.testing.assert_array_equal(back.scans, graph.scans)
    for relation, original in zip(back.pairwise, graph.pairwise, strict=True):
        assert relation.nodes == original.nodes
        np.testing.assert_array_equal(relation.measurement, original.measurement)
        largest = np.abs(original.information).max()
        np.testing.assert_allclose(relation.information, original.information, atol=1e-12 * largest)
    poses = dict(zip(graph.scans.tolist(), graph.poses, strict=True))
    assert energy_of_g2o(text, poses) == pytest.approx(energy(graph), rel=1e-6)


def test_a_graph_of_scans_is_written_with_its_keyframes_alone():
    lines = write_g2o(small_graph()).decode().splitlines()
    assert lines[:2] == ["VERTEX_SE2 0 0.0 0.0 0.0", "VERTEX_SE2 7 2.0 0.5 0.1"]
    assert lines[-1] == "FIX 0"
    assert [line.split()[:3] for line in lines[2:-1]] == [["EDGE_SE2", "0", "7"], ["EDGE_SE2", "0", "7"]]


def test_a_file_without_vertices_is_chained_by_the_fewest_edges(tmp_path: Path):
    information = "1 0 0 1 0 1"
    graph = read(
        tmp_path,
        f"EDGE_SE2 2 3 1 0 1 {information}\nEDGE_SE2 2 4 1 1 0 {information}\n"
        f"EDGE_SE2 3 4 9 9 9 {information}\nEDGE_SE2 7 4 2 0 3.14159 {information}\n",
    )
    np.testing.assert_allclose(graph.poses[:3], [[0, 0, 0], [1, 0, 1], [1, 1, 0]])
    # The last edge is walked backwards.
    np.testing.assert_allclose(compose(graph.poses[3], [2, 0, 3.14159]), [1, 1, 0], atol=1e-12)


def test_marginals_of_two_scans_are_the_hessian_in_the_frame_of_pose_c():
    # c stands at 90°, so its x axis is the local y axis: information 4 along local x is 4 along y of c.
    H = np.zeros((6, 6))
    H[3:, 3:] = np.diag([4.0, 1.0, 9.0])
    relation = NScan((5, 8), np.array([[1.0, 1.0, np.pi / 2], [1.0, 3.0, np.pi / 2]]), H, 0, "nscan", 0.5)
    (edge,) = pairwise_marginals(relation, relation.poses)
    assert (edge.nodes, edge.origin, edge.score) == ((5, 8), "nscan", 0.5)
    np.testing.assert_allclose(edge.measurement, [2, 0, 0], atol=1e-15)
    np.testing.assert_allclose(edge.information, np.diag([1, 4, 9]), atol=1e-12)


def test_marginals_are_the_blocks_of_the_covariance():
    rng = np.random.default_rng(3)
    poses = rng.normal(size=(4, 3))
    root = rng.normal(size=(12, 12))
    relation = NScan((0, 1, 2, 3), poses, root @ root.T, 2, "nscan")
    others = [0, 1, 3]
    free = [3 * index + k for index in others for k in range(3)]
    covariance = np.linalg.inv(relation.hessian[np.ix_(free, free)])
    for block, (index, edge) in enumerate(
        zip(others, pairwise_marginals(relation, relation.poses), strict=True)
    ):
        assert edge.nodes == (2, index)
        np.testing.assert_allclose(edge.measurement, relative(poses[index], poses[2]))
        # Σ of the components of the relative pose is JΣJᵗ, with J from central differences.
        step = 1e-6 * np.eye(3)
        J = np.stack(
            [
                relative(poses[index] + d, poses[2]) / 2e-6 - relative(poses[index] - d, poses[2]) / 2e-6
                for d in step
            ],
            axis=1,
        )
        own = covariance[3 * block : 3 * block + 3, 3 * block : 3 * block + 3]
        np.testing.assert_allclose(np.linalg.inv(edge.information), J @ own @ J.T, rtol=1e-5, atol=1e-7)


def test_a_direction_that_nothing_holds_gets_next_to_no_information():
    # Two of three scans slide along x together: they hold each other, but nothing holds them to pose c.
    slide = np.array([0, 0, 0, 1.0, 0, 0, -1.0, 0, 0])
    H = np.outer(slide, slide) + np.diag([0, 0, 0, 0, 1.0, 1.0, 0, 1.0, 1.0])
    edges = pairwise_marginals(NScan((0, 1, 2), np.zeros((3, 3)), H, 0, "nscan"), np.zeros((3, 3)))
    for edge in edges:
        np.testing.assert_allclose(edge.information, np.diag([1e-9, 1, 1]), atol=1e-12)


def test_negative_curvature_gives_no_negative_information():
    H = np.zeros((6, 6))
    H[3:, 3:] = np.diag([-2.0, 1.0, 1.0])
    (edge,) = pairwise_marginals(NScan((0, 1), np.zeros((2, 3)), H, 0, "nscan"), np.zeros((2, 3)))
    np.testing.assert_allclose(edge.information, np.diag([1e-9, 1, 1]), atol=1e-12)


def test_written_marginals_stand_in_the_frame_of_the_measurement():
    graph = small_graph()
    graph.nscan = []
    z = np.array([1.0, 0.0, np.pi / 2])
    graph.pairwise = [Pairwise((0, 2), z, rotated_information(z, np.diag([1.0, 4.0, 9.0])), "loop")]
    values = [float(field) for field in write_g2o(graph).decode().splitlines()[-2].split()[3:]]
    np.testing.assert_allclose(values, [1, 0, np.pi / 2, 1, 0, 0, 4, 0, 9], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("VERTEX_SE2 0 0 0\n", "line 1: VERTEX_SE2 has 3 values instead of 4"),
        ("\nVERTEX_SE2 0 0 0 x\n", "line 2: could not convert string to float: 'x'"),
        ("VERTEX_SE2 0 0 0 nan\n", "line 1: a number is not finite"),
        ("VERTEX_SE2 a 0 0 0\n", "line 1: 'a' is not a vertex id"),
        ("VERTEX_SE2 -1 0 0 0\n", "line 1: '-1' is not a vertex id"),
        ("VERTEX_SE2 1 0 0 0\nVERTEX_SE2 1 0 0 0\n", "line 2: vertex 1 is there already"),
        ("VERTEX_SE2 1 0 0 0\nEDGE_SE2 1 2 0 0 0 1 0 0 1 0 1\n", "line 2: there is no vertex 2"),
        ("VERTEX_SE2 1 0 0 0\nFIX 3\n", "line 2: there is no vertex 3"),
        ("FIX 1\nFIX 2\n", "line 2: a second vertex is fixed"),
        ("EDGE_SE2 1 1 0 0 0 1 0 0 1 0 1\n", "line 1: the edge joins vertex 1 with itself"),
        (
            "EDGE_SE2 1 2 0 0 0 1 2 0 1 0 1\n",
            "line 1: the information matrix has a negative eigenvalue, -1 beside 3, which rounding does not "
            "explain; mend or remove the line",
        ),
        ("EDGE_SE2 1 2 0 0 0 1 0 0 1 0\n", "line 1: EDGE_SE2 has 10 values instead of 11"),
        (
            "EDGE_SE2 1 2 0 0 0 1 0 0 1 0 1\nEDGE_SE2 3 4 0 0 0 1 0 0 1 0 1\n",
            "line 2: no VERTEX_SE2 lines, and no edges lead from vertex 1 to vertex 3",
        ),
        ("VERTEX_XY 0 0 0\n", "graph.g2o: no VERTEX_SE2 or EDGE_SE2 line; 1 VERTEX_XY line skipped"),
        ("", "graph.g2o: no VERTEX_SE2 or EDGE_SE2 line"),
    ],
)
def test_a_malformed_line_is_named(tmp_path: Path, text: str, problem: str):
    with pytest.raises(InputDataError, match=problem):
        read(tmp_path, text)
