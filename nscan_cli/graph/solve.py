"""Optimise a whole graph: all keyframes from all relations (paper, IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.graph.initialise import chordal_start
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise import Optimum, optimise
from nscan_cli.graph.relation import Relation
from nscan_cli.graph.system import GraphEnergy
from nscan_cli.poses import Indices

TRIAL = 100
"""Iterations after which two starts are compared; only the better one goes on."""


@dataclass(frozen=True)
class GraphOptimum:
    """The energy Σ fᵗHf of all relations that is left, and how it was reached."""

    energy: float
    iterations: int
    converged: bool
    components: int
    """Parts that no relation connects; a keyframe without any relation is one."""


@dataclass(frozen=True)
class Component:
    """Keyframes that relations connect."""

    keyframes: Indices
    """Ids, increasing; the first one is held where it is."""
    relations: list[Relation]

    def energy(self, nodes: int) -> GraphEnergy:
        """The energy of the keyframes' poses; `nodes` is the number of nodes of the graph."""
        positions = np.full(nodes, -1)
        positions[self.keyframes] = np.arange(len(self.keyframes))
        return GraphEnergy(len(self.keyframes), self.relations, positions)


def optimise_graph(graph: Graph, max_iterations: int = 1000, tolerance: float = 1e-6) -> GraphOptimum:
    """Move the keyframes to the minimum of the graph's energy, and the attached nodes with them.

    Starts once from the given poses and once from the chordal start, and keeps the lower minimum. The
    first keyframe of each component stays. Marginals in the graph belonged to the poses before: they
    are removed.
    """
    total, iterations, converged = 0.0, 0, True
    parts = components(graph)
    poses = graph.poses.copy()
    for part in parts:
        if len(part.keyframes) == 1:
            continue
        energy = part.energy(len(graph))
        given = poses[part.keyframes]
        best: Optimum | None = None
        for start in (given, chordal_start(energy, given)):
            found = optimise(energy, start, min(TRIAL, max_iterations), tolerance)
            iterations += found.iterations
            if best is None or not best.energy <= found.energy * (1 + 1e-9):
                best = found
        assert best is not None
        if not best.converged:
            best = optimise(energy, best.poses, max_iterations, tolerance)
            iterations += best.iterations
        poses[part.keyframes] = best.poses
        total += best.energy
        converged &= best.converged
    graph.move_keyframes(graph.keyframes, poses[graph.keyframes])
    graph.marginals = {}
    return GraphOptimum(total, iterations, converged, len(parts))


def components(graph: Graph) -> list[Component]:
    """The connected parts of the graph, in order of their first keyframes."""
    relations = graph.relations
    labels = list(range(len(graph)))

    def label(node: int) -> int:
        while labels[node] != node:
            labels[node] = node = labels[labels[node]]
        return node

    for relation in relations:
        first = label(relation.nodes[0])
        for node in relation.nodes[1:]:
            labels[label(node)] = first
    keyframes = graph.keyframes
    parts: dict[int, tuple[list[int], list[Relation]]] = {}
    for keyframe in keyframes:
        parts.setdefault(label(int(keyframe)), ([], []))[0].append(int(keyframe))
    for relation in relations:
        parts[label(relation.nodes[0])][1].append(relation)
    return [Component(np.array(ids, dtype=np.int64), relations) for ids, relations in parts.values()]
