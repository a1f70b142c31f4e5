"""Graphs for the tests of file formats: one with every kind of record, and arbitrary ones."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from nscan_cli.files.inputs import label, read_text
from nscan_cli.files.limits import GRAPH
from nscan_cli.graph.io.tum import Trajectory, parse_tum
from nscan_cli.graph.model import Graph, Loop, NScan, Pairwise


def small_graph() -> Graph:
    """Three scans, two of them keyframes, with a relation of each type."""
    return Graph(
        scans=np.array([0, 5, 7]),
        stamps=["976052896.784509", "976052897.100000", "976052898.5"],
        poses=np.array([[0.0, -0.0, 0.0], [1.0, 0.25, -np.pi], [2.0, 0.5, 0.1]]),
        odometry=np.array([[0.0, 0.0, 0.0], [1.1, 0.2, 0.5], [2.1, 0.4, 7.0]]),
        anchors=np.array([0, 0, 2]),
        pairwise=[Pairwise((0, 2), np.array([2.0, 0.5, 0.1]), np.diag([100.0, 50.0, 400.0]), "track", 0.75)],
        nscan=[NScan((2, 0), np.array([[2.0, 0.5, 0.1], [0.0, 0.0, 0.0]]), np.eye(6), 1, "nscan", 1 / 3)],
        loops=[Loop((0, 2), False, 'ambiguous: "twice"', 0.5)],
        marginals={2: np.diag([0.01, 0.02, 0.0012345678])},
        provenance={
            "tool": {"name": "nscan-cli", "version": "0.1.0"},
            "inputs": [{"name": "a.log", "sha256": "0" * 64, "bytes": 12}],
            "parameters": {"every": 1},
        },
    )


numbers = st.floats(-1e4, 1e4)
angles = st.floats(-10, 10)
poses = st.tuples(numbers, numbers, angles)


@st.composite
def matrices(draw: st.DrawFn, size: int) -> np.ndarray:
    """Positive definite, of any scale."""
    seed = draw(st.integers(0, 2**32 - 1))
    root = np.random.default_rng(seed).normal(size=(size, size)) * 10.0 ** draw(st.integers(-3, 3))
    return root @ root.T


@st.composite
def graphs(draw: st.DrawFn, all_keyframes: bool = False) -> Graph:
    """Two to six nodes with relations of both types among the keyframes."""
    count = draw(st.integers(2, 6))
    scans = sorted(draw(st.sets(st.integers(0, 10**6), min_size=count, max_size=count)))
    keyframes = [0, count - 1] if not all_keyframes else list(range(count))
    anchors = [node if node in keyframes else draw(st.sampled_from(keyframes)) for node in range(count)]
    pairs = st.lists(st.sampled_from(keyframes), min_size=2, max_size=2, unique=True)
    graph = Graph(
        scans=np.array(scans),
        stamps=[f"{stamp:.6f}" for stamp in range(count)],
        poses=np.array([draw(poses) for _ in range(count)]),
        odometry=np.array([draw(poses) for _ in range(count)]) if draw(st.booleans()) else None,
        anchors=np.array(anchors),
    )
    for _ in range(draw(st.integers(0, 2))):
        a, b = draw(pairs)
        graph.pairwise.append(Pairwise((a, b), np.array(draw(poses)), draw(matrices(3)), "track"))
    for _ in range(draw(st.integers(0, 1))):
        members = draw(st.lists(st.sampled_from(keyframes), min_size=2, max_size=4, unique=True))
        n = len(members)
        local = np.array([draw(poses) for _ in range(n)])
        graph.nscan.append(
            NScan(tuple(members), local, draw(matrices(3 * n)), draw(st.integers(0, n - 1)), "nscan")
        )
    return graph


def read_tum(path: str) -> Trajectory:
    """The trajectory of a TUM file."""
    return parse_tum(read_text(path, GRAPH), label(path))
