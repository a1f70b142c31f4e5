"""Pose graphs in g2o's text format: VERTEX_SE2, EDGE_SE2 and FIX; other tags are skipped and counted.

    VERTEX_SE2 id x y θ
    EDGE_SE2 i j dx dy dθ I11 I12 I13 I22 I23 I33
    FIX id

The error of an edge is z⁻¹ ∘ (x_i⁻¹ ∘ x_j) in g2o, so its translation stands in the frame of the
measurement z; in eq. (16) it is (x̂_j ⊖ x̂_i) − z. The information is rotated by the angle of z between
the two, which leaves the energy as it is.
"""

from __future__ import annotations

import hashlib
import io
from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.finite import check_finite
from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.graph.relation import Relation
from nscan_cli.graph.triangles import from_upper_triangle, is_indefinite, upper_triangle
from nscan_cli.inputs import base_name, label, read_text
from nscan_cli.limits import DISTANCE, GRAPH, INFORMATION, KINDS, Limit
from nscan_cli.logs.scan import Source
from nscan_cli.poses import Array, compose, inverse, relative, rotated_information
from nscan_cli.provenance import provenance_of

REMEDY = "mend or remove the line"
LARGEST_ID = 2**53
LEAST_SHARE = 1e-9
"""Of the greatest eigenvalue of a marginal's information."""


@dataclass
class _Content:
    """The lines of a file by their kind; edges as (line, i, j, measurement, information)."""

    vertices: dict[int, Array] = field(default_factory=dict)
    edges: list[tuple[int, int, int, Array, Array]] = field(default_factory=list)
    fixed: dict[int, int] = field(default_factory=dict)
    """Vertex → line."""
    skipped: Counter[str] = field(default_factory=Counter)


def read_g2o(path: str) -> Graph:
    """The graph of a g2o file; "-" reads standard input.

    Nodes are the vertices in order of their ids, all of them keyframes; a node's scan number is the
    vertex's id, its stamp its row. Edges between vertices that follow each other get the origin
    odometry, the others loop. A file without vertices gets its poses from the edges: the fewest from
    the vertex of the smallest id, which is at the origin. FIX only chooses the frame, which is free
    here, so it is checked and dropped; one vertex may be fixed. How many lines of which tags were
    skipped is in provenance["skipped"].

    Raises InputMissingError when the file cannot be read, InputDataError on a malformed line.
    """
    return parse_g2o(read_text(path, GRAPH), path)


def parse_g2o(data: bytes, path: str) -> Graph:
    """The graph in the bytes of a g2o file, as read_g2o gives it."""
    name = label(path)
    content = _Content()
    for number, line in enumerate(io.BytesIO(data), start=1):
        fields = line.decode("utf-8", errors="replace").split("#", 1)[0].split()
        if not fields:
            continue
        try:
            _take(content, number, fields)
        except ValueError as error:
            raise InputDataError(name, str(error), REMEDY, line=number) from error
    if not content.vertices and not content.edges:
        raise InputDataError(name, "no VERTEX_SE2 or EDGE_SE2 line", "give a 2D pose graph of g2o")
    vertices = content.vertices or _chained(content, name)
    graph = _graph(content, vertices, name)
    source = Source(base_name(path), hashlib.sha256(data).hexdigest(), len(data))
    graph.provenance = provenance_of([source], {})
    graph.provenance["skipped"] = dict(sorted(content.skipped.items()))
    return graph


def write_g2o(graph: Graph) -> bytes:
    """The keyframes and relations as g2o text; the first keyframe is fixed. A vertex's id is its scan number.

    g2o has a form for pairwise relations alone: any other is replaced by the marginals of its Hessian
    between pose c and every other pose, as pairwise edges. This loses what it says about the other poses
    among each other, and a graph optimised from the file differs from one that has the whole Hessian.
    Nodes that are no keyframes are left out. Numbers have the digits that read back exactly. Raises
    NotFiniteError.
    """
    check_finite("the poses of the graph", graph.poses)
    keyframes = graph.keyframes.tolist()
    names = graph.scans.tolist()
    lines = [f"VERTEX_SE2 {names[node]} {_numbers(graph.poses[node])}" for node in keyframes]
    edges: list[Pairwise] = []
    for each in graph.relations:
        poses = graph.poses[list(each.nodes)]
        edges += [each] if isinstance(each, Pairwise) else pairwise_marginals(each, poses)
    for relation in edges:
        z = relation.measurement
        information = upper_triangle(rotated_information(inverse(z), relation.information))
        a, b = relation.nodes
        check_finite(f"the edge of {relation.nodes}", z, information)
        lines.append(f"EDGE_SE2 {names[a]} {names[b]} {_numbers(z)} {_numbers(information)}")
    # GTSAM's reader drops all edges after a tag that it does not know.
    lines += [f"FIX {names[node]}" for node in keyframes[:1]]
    return ("\n".join(lines) + "\n").encode()


def pairwise_marginals(relation: Relation, poses: Array) -> list[Pairwise]:
    """A relation as pairwise relations from pose c to each of the others: a lossy replacement.

    With pose c held fixed, the information on pose i alone is the Schur complement
    H_ii − H_ir H_rr⁺ H_ri over all other poses r (the inverse of its block of the covariance, where H has
    an inverse), turned from the relation's frame into that of pose c.
    One that is not linear counts as it is at its global poses (n, 3).
    Directions that the relation does not hold get next to no information, LEAST_SHARE of the greatest: with
    none at all, readers that factorise after Cholesky (GTSAM) would make much out of rounding. The
    Hessian's negative eigenvalues count as 0.
    """
    term = relation.term()
    local, hessian, c, _ = term if term.at is None else term.at(poses)
    others = np.delete(np.arange(len(relation.nodes)), c)
    free = (3 * others[:, None] + np.arange(3)).ravel()
    to_frame_of_c = inverse(local[c])
    measurements = relative(local[others], local[c])
    return [
        Pairwise(
            nodes=(relation.nodes[c], relation.nodes[index]),
            measurement=measurement,
            information=rotated_information(to_frame_of_c, information),
            origin=relation.origin,
            score=relation.score,
        )
        for index, measurement, information in zip(
            others, measurements, _marginal_blocks(hessian[np.ix_(free, free)]), strict=True
        )
    ]


def _marginal_blocks(information: Array) -> Array:
    """The information (m, 3, 3) on each of m poses alone, from that on all of them (3 m, 3 m)."""
    m = len(information) // 3
    eigenvalues, vectors = np.linalg.eigh(information)
    if eigenvalues[0] > 1e-9 * eigenvalues[-1]:
        covariance = (vectors / eigenvalues) @ vectors.T
        blocks = np.linalg.inv(covariance.reshape(m, 3, m, 3)[np.arange(m), :, np.arange(m)])
    else:
        H = (vectors * np.maximum(eigenvalues, 0)) @ vectors.T
        blocks = np.empty((m, 3, 3))
        for block in range(m):
            i = np.arange(3 * block, 3 * block + 3)
            r = np.delete(np.arange(3 * m), i)
            H_ir = H[np.ix_(i, r)]
            blocks[block] = H[np.ix_(i, i)] - H_ir @ np.linalg.pinv(H[np.ix_(r, r)], 1e-12, True) @ H_ir.T
    eigenvalues, vectors = np.linalg.eigh(0.5 * (blocks + blocks.transpose(0, 2, 1)))
    held = np.maximum(eigenvalues, LEAST_SHARE * eigenvalues[:, -1:])
    sound: Array = (vectors * held[:, None, :]) @ vectors.transpose(0, 2, 1)
    return 0.5 * (sound + sound.transpose(0, 2, 1))


def _numbers(values: Array) -> str:
    return " ".join(repr(value + 0.0) for value in values.tolist())


def _take(content: _Content, line: int, fields: list[str]) -> None:
    """Put one line into the content. Raises ValueError saying what is wrong with it."""
    tag = fields[0]
    if tag == "VERTEX_SE2":
        _check_length(fields, 5)
        vertex = _id(fields[1])
        if vertex in content.vertices:
            raise ValueError(f"vertex {vertex} is there already")
        content.vertices[vertex] = _numbers_of(fields[2:], DISTANCE)
    elif tag == "EDGE_SE2":
        _check_length(fields, 12)
        i, j = _id(fields[1]), _id(fields[2])
        if i == j:
            raise ValueError(f"the edge joins vertex {i} with itself")
        z = _numbers_of(fields[3:6], DISTANCE)
        information = from_upper_triangle(_numbers_of(fields[6:], INFORMATION), 3)
        if is_indefinite(information):
            raise ValueError("the information matrix has a negative eigenvalue")
        content.edges.append((line, i, j, z, information))
    elif tag == "FIX":
        for text in fields[1:]:
            content.fixed.setdefault(_id(text), line)
        if len(content.fixed) > 1:
            raise ValueError("a second vertex is fixed, but only one can be")
    else:
        known = tag in content.skipped or len(content.skipped) < KINDS.value
        content.skipped[tag if known else "others"] += 1


def _check_length(fields: list[str], length: int) -> None:
    if len(fields) != length:
        raise ValueError(f"{fields[0]} has {len(fields) - 1} values instead of {length - 1}")


def _id(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 17 and int(text) <= LARGEST_ID):
        raise ValueError(f"{text!r} is no vertex id")
    return int(text)


def _numbers_of(texts: Iterable[str], limit: Limit) -> Array:
    values = np.array([float(text) for text in texts])
    if not np.isfinite(values).all():
        raise ValueError("a number is not finite")
    if (np.abs(values) > limit.value).any():
        raise ValueError(f"a number is beyond {limit.value:g}")
    return values


def _chained(content: _Content, name: str) -> dict[int, Array]:
    """Poses by the fewest edges from the vertex of the smallest id, breadth first in file order."""
    steps: dict[int, list[tuple[int, Array]]] = {}
    for _, i, j, z, _ in content.edges:
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
    for line, i, _, _, _ in content.edges:
        if i not in poses:
            problem = f"no VERTEX_SE2 lines, and no edges lead from vertex {first} to vertex {i}"
            raise InputDataError(name, problem, "add the vertices or the missing edges", line=line)
    return poses


def _graph(content: _Content, vertices: dict[int, Array], name: str) -> Graph:
    ids = sorted(vertices)
    rows = {vertex: row for row, vertex in enumerate(ids)}
    mentioned = [(line, vertex) for line, i, j, _, _ in content.edges for vertex in (i, j)]
    for line, vertex in mentioned + [(line, vertex) for vertex, line in content.fixed.items()]:
        if vertex not in rows:
            raise InputDataError(name, f"there is no vertex {vertex}", "add its VERTEX_SE2 line", line=line)
    graph = Graph(
        scans=np.array(ids, dtype=np.int64),
        stamps=[str(row) for row in range(len(ids))],
        poses=np.array([vertices[vertex] for vertex in ids]),
        odometry=None,
        anchors=np.arange(len(ids), dtype=np.int64),
    )
    for _, i, j, z, information in content.edges:
        a, b = rows[i], rows[j]
        origin = "odometry" if abs(a - b) == 1 else "loop"
        graph.pairwise.append(Pairwise((a, b), z, rotated_information(z, information), origin))
    return graph
