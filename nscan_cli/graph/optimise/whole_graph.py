"""Optimisation of a whole graph: all keyframes, all relations (paper, IV)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.chordal import chordal_start
from nscan_cli.graph.optimise.graduated_nonconvexity import RobustOptions, unfolded
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import Optimum, StopOptions, optimise_poses
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class WholeGraphOptions:
    """How long a whole graph is optimised, and how other minima are tried."""

    stop: StopOptions = field(default_factory=lambda: StopOptions(max_iterations=1000))
    """When an optimisation ends."""
    trial_iterations: int = 100
    """Iterations after which the starts are compared, and only the better one goes on. A larger number takes
    longer and compares minima that are nearer."""
    max_unfoldings: int = 3
    """Largest number of attempts to leave a local minimum. Each has to reach a lower energy than the one
    before. A larger number takes longer."""
    unfolding: RobustOptions = field(
        default_factory=lambda: RobustOptions(
            tail_probability=0.05, bound_factor=1.0, narrowing=1.2, iterations=10
        )
    )
    """Graduated non-convexity on the way out of a local minimum, where all relations are doubted."""
    same_energy: float = 1e-6
    """Energies count as equal if they differ by a smaller share of 1 + energy. Of equal minima the first is
    kept, which is that of the given poses. A larger share keeps these more often."""


@dataclass(frozen=True)
class Component:
    """A connected component of the graph."""

    keyframes: Indices
    """(K,) ids, increasing; the first keyframe is fixed."""
    relations: list[Relation]
    """All relations between these keyframes."""

    def energy(self, nodes: int) -> GraphEnergy:
        """The energy of the keyframes' poses; the graph has `nodes` nodes."""
        positions = np.full(nodes, -1)
        positions[self.keyframes] = np.arange(len(self.keyframes))
        return GraphEnergy(len(self.keyframes), self.relations, positions)


def optimise_graph(graph: Graph, options: WholeGraphOptions = WholeGraphOptions()) -> Optimum:
    """Move the keyframes to the minimum of the graph's energy, and the attached nodes with them.

    The lowest minimum of several starts is kept. The first keyframe of each component stays. The graph's
    marginals belong to the old poses and are removed. Returns the poses (N, 3) and the energy Σ fᵗHf.
    """
    total, iterations, converged = 0.0, 0, True
    poses = graph.poses.copy()
    for part in components(graph):
        if len(part.keyframes) == 1:
            continue
        lowest = _lowest_minimum(part.energy(len(graph)), poses[part.keyframes], options)
        poses[part.keyframes] = lowest.poses
        total += lowest.energy
        iterations += lowest.iterations
        converged &= lowest.converged
    graph.move_keyframes(graph.keyframes, poses[graph.keyframes])
    graph.marginals = {}
    return Optimum(graph.poses, total, iterations, converged)


def _lowest_minimum(energy: GraphEnergy, given: Array, options: WholeGraphOptions) -> Optimum:
    """The lowest minimum from the poses given (K, 3), the chordal start, and the unfolded best of both.

    The iterations are those of all starts together.
    """
    stop, iterations = options.stop, 0
    trial = dataclasses.replace(stop, max_iterations=min(options.trial_iterations, stop.max_iterations))
    best: Optimum | None = None
    for start in (given, chordal_start(energy, given)):
        found = optimise_poses(energy, start, trial)
        iterations += found.iterations
        if best is None or _is_lower(found, best, options.same_energy):
            best = found
    assert best is not None
    if not best.converged:
        best = optimise_poses(energy, best.poses, stop)
        iterations += best.iterations
    for _ in range(options.max_unfoldings):
        other_start = unfolded(energy, best.poses, options.unfolding)
        if other_start is None:
            break
        found = optimise_poses(energy, other_start, stop)
        iterations += found.iterations
        if not _is_lower(found, best, options.same_energy):
            break
        best = found
    return dataclasses.replace(best, iterations=iterations)


def _is_lower(found: Optimum, best: Optimum, same_energy: float) -> bool:
    return found.energy < best.energy - same_energy * (1 + best.energy) or not np.isfinite(best.energy)


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
