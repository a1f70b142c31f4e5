"""The edges of a graph as pairs of keyframes, by kind of relation."""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.graph.relations.base import Relation
from nscan_cli.graph.relations.registry import is_joint
from nscan_cli.mapping.figures.canvas import GRAY, GREEN, VERMILLION
from nscan_cli.poses import Indices, path_lengths
from nscan_cli.slam.local_matching.options import NScanOptions

EDGE_COLOURS = {"nScan": GREEN, "pairwise": GRAY, "loop": VERMILLION}
"""In the order of drawing, with loops on top."""


def edges_by_kind(graph: Graph) -> dict[str, Indices]:
    """The sorted pairs (E, 2) of joined nodes for each of EDGE_COLOURS.

    A joint relation joins its fixed scan with each of the others. If it closes a loop, its edges to other
    visits are of the kind loop, or all its edges if none leads to another visit.
    """
    path = path_lengths(graph.poses)
    found: dict[str, set[tuple[int, int]]] = {kind: set() for kind in EDGE_COLOURS}
    for relation in graph.pairwise:
        found["loop" if relation.origin == "loop" else "pairwise"].add(relation.nodes)
    joints: list[Relation] = [*graph.nscan, *graph.others]
    for joint in joints:
        centre = joint.nodes[joint.term().fixed]
        others = [node for node in joint.nodes if node != centre]
        closing = others if joint.origin == "loop" else []
        if far := [node for node in closing if abs(path[node] - path[centre]) > NScanOptions.visit_path]:
            closing = far
        found["loop"].update((centre, node) for node in closing)
        kind = "nScan" if is_joint(joint) else "pairwise"
        found[kind].update((centre, node) for node in others if node not in closing)
    return {kind: np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2) for kind, pairs in found.items()}
