"""Reading and writing of pose graphs in the text formats of g2o and TORO, and what of them is not read.

The error of an edge is z⁻¹ ∘ (x_i⁻¹ ∘ x_j) in g2o, with its translation in the frame of the measurement z.
In eq. (16) it is (x̂_j ⊖ x̂_i) − z. Rotating the information by the angle of z keeps the energy the same.
"""

from __future__ import annotations

import hashlib
import re
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.files.finite import check_finite
from nscan_cli.files.inputs import base_name, label
from nscan_cli.files.provenance import Source, provenance_of
from nscan_cli.files.text import counted
from nscan_cli.graph.io.g2o_lines import G2O_REMEDY, G2oLines, key_text, keys, read_lines, rows
from nscan_cli.graph.io.json_fields import LARGEST_INTEGER
from nscan_cli.graph.io.symmetric_matrices import from_upper_triangle, upper_triangle
from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.graph.relations.pairwise_marginals import pairwise_marginals
from nscan_cli.graph.relations.registry import is_pairwise
from nscan_cli.graph.relations.semidefinite import IndefiniteError, semidefinite
from nscan_cli.poses import Array, Indices, compose, inverse, rotated_information


def parse_g2o(data: bytes, path: str) -> Graph:
    """The graph in the bytes of a g2o file; errors and the provenance name the file `path`.

    The nodes are the vertices in order of their keys, all of them keyframes. A node's scan number is its
    vertex key, and its stamp is its row. Where a key is too large for a scan number, the scan numbers are
    rows, and the keys are the graph's `vertices`. Edges between consecutive vertices have the origin
    odometry, the others loop. Without vertices, poses come from the fewest edges to the vertex of the
    smallest key, which is at the origin. FIX only chooses the frame, so it is checked and ignored; one vertex
    may be fixed. provenance["skipped"] counts the skipped lines by tag; `loss_messages` explains them.

    Raises InputDataError on a malformed line.
    """
    name = label(path)
    lines = read_lines(data, name)
    if not lines.vertices and not lines.edge_lines:
        others = {tag: n for tag, n in lines.skipped.items() if tag.startswith(("VERTEX", "EDGE"))}
        problem = "; ".join(["no VERTEX_SE2 or EDGE_SE2 line", *loss_messages(others)])
        raise InputDataError(name, problem, "give a 2D pose graph of g2o")
    graph = _graph_of_lines(lines, name)
    source = Source(base_name(path), hashlib.sha256(data).hexdigest(), len(data))
    graph.provenance = provenance_of([source], {})
    graph.provenance["skipped"] = dict(sorted(lines.skipped.items()))
    return graph


def write_g2o(graph: Graph) -> bytes:
    """The keyframes and relations as g2o text; the first keyframe is fixed.

    A vertex's key is its key in the g2o file that the graph came from, or its scan number.

    g2o has pairwise relations only: any other relation is replaced by the marginals of its Hessian between
    pose c and every other pose. This loses the correlations between the other poses, so a graph optimised
    from the file differs from one with the whole Hessian. Nodes that are not keyframes are left out. Numbers
    have the digits that read back exactly. Raises NotFiniteError.
    """
    check_finite("the poses of the graph", graph.poses)
    keyframes = graph.keyframes.tolist()
    names = graph.scans.tolist() if graph.vertices is None else graph.vertices
    lines = [f"VERTEX_SE2 {names[node]} {_number_texts(graph.poses[node])}" for node in keyframes]
    edges: list[Pairwise] = []
    for each in graph.relations:
        poses = graph.poses[list(each.nodes)]
        edges += [each] if is_pairwise(each) else pairwise_marginals(each, poses)
    for relation in edges:
        z = relation.measurement
        information = upper_triangle(rotated_information(inverse(z), relation.information))
        a, b = relation.nodes
        check_finite(f"the edge of {relation.nodes}", z, information)
        lines.append(f"EDGE_SE2 {names[a]} {names[b]} {_number_texts(z)} {_number_texts(information)}")
    # GTSAM's reader drops all edges after a tag that it does not know.
    lines += [f"FIX {names[node]}" for node in keyframes[:1]]
    return ("\n".join(lines) + "\n").encode()


def _number_texts(values: Array) -> str:
    return " ".join(repr(value + 0.0) for value in values.tolist())


def _poses_along_edges(lines: G2oLines, name: str) -> dict[int, Array]:
    """Poses by the fewest edges from the vertex of the smallest key, breadth first in order of the file."""
    steps: dict[int, list[tuple[int, Array]]] = {}
    ends = keys(lines.ends).reshape(-1, 2).tolist()
    for (i, j), z in zip(ends, rows(lines.measurements, 3), strict=True):
        steps.setdefault(i, []).append((j, z))
        steps.setdefault(j, []).append((i, inverse(z)))
    first = min(steps)
    poses = {first: np.zeros(3)}
    queue = deque([first])
    while queue:
        vertex = queue.popleft()
        for other, z in steps[vertex]:
            if other not in poses:
                poses[other] = compose(poses[vertex], z)
                queue.append(other)
    for line, (i, _) in zip(lines.edge_lines, ends, strict=True):
        if i not in poses:
            ends_of_path = f"from vertex {key_text(first)} to vertex {key_text(i)}"
            problem = f"no VERTEX_SE2 lines, and no edges lead {ends_of_path}"
            raise InputDataError(name, problem, "add the vertices or the missing edges", line=line)
    return poses


def _graph_of_lines(lines: G2oLines, name: str) -> Graph:
    if lines.vertices:
        found, poses = np.array(list(lines.vertices), dtype=np.uint64), rows(lines.poses, 3)
    else:
        chained = _poses_along_edges(lines, name)
        found, poses = np.array(list(chained), dtype=np.uint64), np.array(list(chained.values()))
    order = np.argsort(found)
    vertices = found[order]
    graph = Graph(
        scans=np.arange(len(vertices), dtype=np.int64),
        stamps=[str(row) for row in range(len(vertices))],
        poses=poses[order],
        odometry=None,
        anchors=np.arange(len(vertices), dtype=np.int64),
    )
    if vertices[-1] <= LARGEST_INTEGER:
        graph.scans = vertices.astype(np.int64)
    else:
        graph.vertices = vertices.tolist()
    graph.pairwise = _pairwise_relations(lines, vertices, name)
    for key, line in lines.fixed.items():
        if key not in lines.other_vertices:
            _rows_of(np.array([key], dtype=np.uint64), vertices, [line], name)
    return graph


def _pairwise_relations(lines: G2oLines, vertices: NDArray[np.uint64], name: str) -> list[Pairwise]:
    """The edges between the vertices with increasing keys (V,)."""
    ends = keys(lines.ends)
    pairs = _rows_of(ends, vertices, np.repeat(lines.edge_lines, 2).tolist(), name).reshape(-1, 2)
    measurements = rows(lines.measurements, 3)
    try:
        information = semidefinite(from_upper_triangle(rows(lines.information, 6), 3))
    except IndefiniteError as error:
        line = lines.edge_lines[error.index]
        raise InputDataError(name, f"the information matrix {error}", G2O_REMEDY, line=line) from error
    return [
        Pairwise((a, b), z, turned, "odometry" if abs(a - b) == 1 else "loop")
        for (a, b), z, turned in zip(
            pairs.tolist(), measurements, rotated_information(measurements, information), strict=True
        )
    ]


def _rows_of(
    wanted: NDArray[np.uint64], vertices: NDArray[np.uint64], lines: Sequence[int], name: str
) -> Indices:
    """The rows of the keys `wanted` (n,), of the n `lines`, among those of all vertices (V,)."""
    found = np.minimum(np.searchsorted(vertices, wanted), len(vertices) - 1)
    missing = np.flatnonzero(vertices[found] != wanted)
    if len(missing):
        first = int(missing[0])
        problem = f"there is no vertex {key_text(int(wanted[first]))}"
        raise InputDataError(name, problem, "add its VERTEX_SE2 line", line=int(lines[first]))
    return found


LANDMARKS = "XY|POINT|LANDMARK|LINE|SEGMENT|PLANE|BEARING"
LOSSES = (
    ("SWITCH", "edges that can be switched off are not read, so these loops are not closed"),
    ("MIXTURE|MAXMIX", "edges with several alternatives are not read, so what they join may come apart"),
    ("PRIOR|GPS|GNSS|UTM", "priors on poses are not read, so the graph's frame is free, and its shape is "
     "that of the edges between poses"),
    (f"VERTEX.*({LANDMARKS})", "landmarks are not read"),
    (f"^(LANDMARK|BR)$|EDGE.*({LANDMARKS})", "observations of landmarks are not read, so the poses are held "
     "by the edges between poses alone"),
    ("ROBUST", "edges with robust kernels are not read, so what they join may come apart"),
    ("OFFSET|CALIB|PARAMS|CAMERA", "offsets and calibrations of sensors are not read, nor edges that need "
     "them"),
    ("VERTEX_?(SE3|3|SIM3)|EDGE_?(SE3|3|SIM3)", "of graphs in space only planar VERTEX_SE3:QUAT and "
     "EDGE_SE3:QUAT are read"),
    ("^VERTEX", "vertices of this kind are not read"),
    ("^(EDGE|ODOMETRY|EQUIV)", "edges of this kind are not read, so what they join may come apart"),
    ("LASER|TAG|IMU|IMAGE", "what sensors saw is not read from a graph"),
    ("", "this tag is not known, and what it says is lost"),
)  # fmt: skip
"""Pattern of tags, and what is lost; the first pattern that matches a tag counts."""
NAMED_TAGS = 5
"""Largest number of tags that one sentence names."""
SHOWN_TAG_LENGTH = 40
"""Characters of a tag that are shown."""


def loss_messages(skipped: Mapping[str, int]) -> list[str]:
    """A sentence for each kind of loss, with the number of skipped lines by tag."""
    kinds: dict[str, list[str]] = {}
    for tag, count in skipped.items():
        lost = next(lost for pattern, lost in LOSSES if re.search(pattern, tag))
        name = tag if re.fullmatch("[!-~]+", tag) else ascii(tag)
        kinds.setdefault(lost, []).append(counted(count, f"{name[:SHOWN_TAG_LENGTH]} line"))
    sentences = []
    for lost, lines in kinds.items():
        if len(lines) > NAMED_TAGS:
            lines[NAMED_TAGS:] = [f"lines of {counted(len(lines) - NAMED_TAGS, 'other tag')}"]
        *before, last = lines
        listed = f"{', '.join(before)} and {last}" if before else last
        sentences.append(f"{listed} skipped: {lost}")
    return sentences
