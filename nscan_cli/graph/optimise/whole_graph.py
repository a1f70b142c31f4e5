"""Optimisation of a whole graph: all keyframes, all relations (paper, IV)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.chordal import chordal_start
from nscan_cli.graph.optimise.graduated_nonconvexity import unfolded
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import Optimum, StopOptions, optimise_poses
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Array, Indices

PATIENT_STOP = StopOptions(max_iterations=1000)
TRIAL_ITERATIONS = 100
"""Iterations after which the starts are compared; only the better one continues."""
MAX_UNFOLDINGS = 3
"""Largest number of attempts to leave a local minimum; each has to reach a lower energy than the one
before."""
SAME_ENERGY = 1e-6
"""Energies that differ by less, relative to 1 + energy, count as equal: then the given poses are kept."""


@dataclass(frozen=True)
class Component:
    """A connected component of the graph."""

    keyframes: Indices
    """Ids, increasing; the first one is fixed."""
    relations: list[Relation]

    def energy(self, nodes: int) -> GraphEnergy:
        """The energy of the keyframes' poses; the graph has `nodes` nodes."""
        positions = np.full(nodes, -1)
        positions[self.keyframes] = np.arange(len(self.keyframes))
        return GraphEnergy(len(self.keyframes), self.relations, positions)


def optimise_graph(graph: Graph, stop: StopOptions = PATIENT_STOP) -> Optimum:
    """Move the keyframes to the minimum of the graph's energy, and the attached nodes with them.

    The lowest minimum of several starts is kept. The first keyframe of each component stays. The graph's
    marginals belong to the old poses and are removed. Returns the poses (N, 3) and the energy Σ fᵗHf.
    """
    total, iterations, converged = 0.0, 0, True
    poses = graph.poses.copy()
    for part in components(graph):
        if len(part.keyframes) == 1:
            continue
        lowest = _lowest_minimum(part.energy(len(graph)), poses[part.keyframes], stop)
        poses[part.keyframes] = lowest.poses
        total += lowest.energy
        iterations += lowest.iterations
        converged &= lowest.converged
    graph.move_keyframes(graph.keyframes, poses[graph.keyframes])
    graph.marginals = {}
    return Optimum(graph.poses, total, iterations, converged)


def _lowest_minimum(energy: GraphEnergy, given: Array, stop: StopOptions) -> Optimum:
    """The lowest minimum from the poses given (K, 3), the chordal start, and the unfolded best of both.

    The iterations are those of all starts together.
    """
    trial = dataclasses.replace(stop, max_iterations=min(TRIAL_ITERATIONS, stop.max_iterations))
    iterations = 0
    best: Optimum | None = None
    for start in (given, chordal_start(energy, given)):
        found = optimise_poses(energy, start, trial)
        iterations += found.iterations
        if best is None or _is_lower(found, best):
            best = found
    assert best is not None
    if not best.converged:
        best = optimise_poses(energy, best.poses, stop)
        iterations += best.iterations
    for _ in range(MAX_UNFOLDINGS):
        other_start = unfolded(energy, best.poses)
        if other_start is None:
            break
        found = optimise_poses(energy, other_start, stop)
        iterations += found.iterations
        if not _is_lower(found, best):
            break
        best = found
    return dataclasses.replace(best, iterations=iterations)


def _is_lower(found: Optimum, best: Optimum) -> bool:
    """Whether a minimum is clearly lower than the best so far, or the best is not finite."""
    return found.energy < best.energy - SAME_ENERGY * (1 + best.energy) or not np.isfinite(best.energy)


def components(graph: Graph) -> list[Component]:
    """The connected components of the graph, in order of their first keyframes."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    relations = graph.relations
    edges = [(relation.nodes[0], node) for relation in relations for node in relation.nodes[1:]]
    a, b = np.array(edges, dtype=np.int64).reshape(-1, 2).T
    links = coo_array((np.ones(len(a)), (a, b)), shape=(len(graph), len(graph)))
    labels = connected_components(links, directed=False)[1].tolist()
    members: dict[int, tuple[list[int], list[Relation]]] = {}
    for keyframe in graph.keyframes.tolist():
        members.setdefault(labels[keyframe], ([], []))[0].append(keyframe)
    for relation in relations:
        members[labels[relation.nodes[0]]][1].append(relation)
    return [Component(np.array(ids, dtype=np.int64), relations) for ids, relations in members.values()]
