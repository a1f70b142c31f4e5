"""Parts of a graph that is too large to be solved as a whole each time that it has grown (paper, V).

New relations move what is near them. Keyframes far away are held meanwhile. For a question about uncertainty
they are left out; they could only lower it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.relations.base import Relation
from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, Mask
from nscan_cli.slam.keyframes.route import Route


class Subgraph(NamedTuple):
    """The keyframes that can move, and the relations that count."""

    relations: Sequence[Relation]
    free: Mask | None = None
    """(K,) which keyframes can move; the others are held. None: all can."""


def held_by_others(route: Route, relations: Sequence[Relation], free: Mask) -> Subgraph:
    """The `free` keyframes, with all relations that contain one of them."""
    nodes = frozenset(route.rows[free].tolist())
    return Subgraph([relation for relation in relations if not nodes.isdisjoint(relation.nodes)], free)


def without_others(
    route: Route, chain: Sequence[Relation], loops: Sequence[Relation], wanted: Mask
) -> Subgraph:
    """The `wanted` keyframes, those that loops tie to them, and the relations among all these.

    `chain[k]` leads from keyframe k to k + 1.
    """
    inner = frozenset(route.rows[wanted].tolist())
    nodes = inner.union(*(loop.nodes for loop in loops if not inner.isdisjoint(loop.nodes)))
    chosen = np.isin(route.rows, list(nodes))
    steps = [chain[k] for k in np.flatnonzero(chosen[:-1] & chosen[1:]).tolist()]
    return Subgraph([*steps, *(loop for loop in loops if nodes.issuperset(loop.nodes))], chosen)


def nearest_keyframes(poses: Array, first: int, end: int, most: int) -> Mask:
    """(K,) the `most` of the poses (K, 3) that are nearest to any of those from `first` to `end`."""
    order = np.argsort(_distances(poses, first, end), kind="stable")
    chosen = np.zeros(len(poses), dtype=np.bool_)
    chosen[order[:most]] = True
    return chosen


@kernel
def _distances(poses: Array, first: int, end: int) -> Array:
    """(K,) squared distances (m²) of poses (K, 3) from the nearest of those from `first` to `end`."""
    distances = np.full(len(poses), np.inf)
    for k in range(len(poses)):
        for other in range(first, end):
            dx, dy = poses[k, 0] - poses[other, 0], poses[k, 1] - poses[other, 1]
            distances[k] = min(distances[k], dx * dx + dy * dy)
    return distances
