"""An upper bound on the uncertainty of keyframes: that along the most certain path to each.

All other relations of the graph can only lower the uncertainty. The bound takes a hundredth of the time of
the whole graph.
"""

from __future__ import annotations

import heapq
import operator
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.relations.base import Relation
from nscan_cli.kernels.array_assignment import assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, Indices, Mask, rotated_information
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.keyframes.tracked_path import TrackedPath


class Links(NamedTuple):
    """E links between keyframes: the covariance that a relation gives one of them when the other is held."""

    held: Indices
    """(E,) keyframes that are held."""
    other: Indices
    """(E,) keyframes at the other ends."""
    covariances: Array
    """(E, 3, 3) covariances of the other keyframes, in the global frame."""


class LinkCache:
    """The links of a growing graph. Links of loops are kept as long as new loops come after the old ones; a
    loop is recognised by its identity."""

    def __init__(self) -> None:
        self._loops: list[Relation] = []
        self._links = _concatenated([])

    def links(self, route: Route, path: TrackedPath, loops: Sequence[Relation]) -> Links:
        """The links of the chain, from each keyframe to the next, and those of all loops."""
        if len(loops) < len(self._loops) or not all(map(operator.is_, self._loops, loops)):
            self._loops, self._links = [], _concatenated([])
        new = [_links_of(loop, route.rows) for loop in loops[len(self._loops) :]]
        if new:
            self._loops, self._links = [*loops], _concatenated([self._links, *new])
        steps = np.arange(len(path))
        covariances = rotated_information(route.poses[steps], path.covariances)
        return _concatenated([Links(steps, steps + 1, covariances), self._links])


def _concatenated(parts: Sequence[Links]) -> Links:
    none = Links(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros((0, 3, 3)))
    return Links(*(np.concatenate(columns) for columns in zip(none, *parts, strict=True)))


def _links_of(relation: Relation, rows: Indices) -> Links:
    """Links from the pose that carries the mapping to each of the others, equal in all directions.

    The keyframes of the nodes are those in `rows` (K,).

    A covariance is at most twice its diagonal. A path from one of the others to another contains the
    difference of two dependent poses, at most twice the sum of their covariances.
    """
    term, nodes = relation.term(), np.searchsorted(rows, relation.nodes)
    others = np.delete(np.arange(len(nodes)), term.fixed)
    free = (3 * others[:, None] + np.arange(3)).ravel()
    eigenvalues, vectors = np.linalg.eigh(term.hessian[np.ix_(free, free)])
    # Where it says nothing, no more than rounding.
    eigenvalues = np.maximum(eigenvalues, 1e-12 * max(eigenvalues[-1], 1.0))
    inverse = ((vectors / eigenvalues) @ vectors.T).reshape(len(others), 3, len(others), 3)
    own = inverse[np.arange(len(others)), :, np.arange(len(others))]
    covariances = np.zeros_like(own)
    covariances[:, 0, 0] = covariances[:, 1, 1] = 4 * np.linalg.eigvalsh(own[:, :2, :2])[:, 1]
    covariances[:, 2, 2] = 4 * own[:, 2, 2]
    return Links(np.full(len(others), nodes[term.fixed]), nodes[others], covariances)


def most_certain_paths(links: Links, poses: Array, origin: int, lever_arm: float) -> tuple[Array, Indices]:
    """The most certain path from one pose to each of all (K, 3): covariances (K, 3, 3) along it, or inf.

    Also returns (K,) the pose before each on its path, −1 without any. Angles count at a distance of
    `lever_arm` (m).

    E. Dijkstra, "A note on two problems in connexion with graphs", 1959.
    """
    ends = np.column_stack([links.held, links.other]).ravel()
    order = np.argsort(ends, kind="stable")
    starts = np.searchsorted(ends[order], np.arange(len(poses) + 1))
    return _most_certain_paths(links, (starts, order // 2), poses, origin, lever_arm)


@kernel
def _most_certain_paths(
    links: Links, incident: tuple[Indices, Indices], poses: Array, origin: int, lever_arm: float
) -> tuple[Array, Indices]:
    """The kernel of most_certain_paths. `incident` has where the links at each node begin (K + 1,), and their
    indices (2E,)."""
    starts, at_node = incident
    covariances, best = np.full((len(poses), 3, 3), np.inf), np.full(len(poses), np.inf)
    by, done = np.full(len(poses), -1), np.zeros(len(poses), dtype=np.bool_)
    before = np.full(len(poses), -1)
    covariances[origin], best[origin] = 0.0, 0.0
    waiting = [(0.0, origin)]
    while len(waiting):
        cost, here = heapq.heappop(waiting)
        if done[here]:
            continue
        done[here] = True
        if by[here] >= 0:
            before[here] = links.held[by[here]] + links.other[by[here]] - here
            _follow(links, by[here], here, poses, covariances)
        for link in at_node[starts[here] : starts[here + 1]]:
            there, own = links.held[link] + links.other[link] - here, links.covariances[link]
            farther = cost + own[0, 0] + own[1, 1] + lever_arm * lever_arm * own[2, 2]
            if farther < best[there]:
                best[there], by[there] = farther, link
                heapq.heappush(waiting, (farther, there))
    return covariances, before


@kernel
def relations_on_paths(before: Indices, wanted: Mask) -> Mask:
    """The wanted keyframes (K,) and all on the paths to them; `before` (K,) as of most_certain_paths."""
    on = wanted.copy()
    for k in range(len(before)):
        here = k
        while wanted[k] and before[here] >= 0 and not on[before[here]]:
            here = before[here]
            on[here] = True
    return on


@kernel
def _follow(links: Links, link: int, there: int, poses: Array, covariances: Array) -> None:
    """C ← A C Aᵗ plus the link's own covariance, A = [[1, 0, −d_y], [0, 1, d_x], [0, 0, 1]] over step d."""
    here = links.held[link] + links.other[link] - there
    moved = covariances[here].copy()
    if there == links.held[link]:
        moved += links.covariances[link]
    dx, dy = poses[there, 0] - poses[here, 0], poses[there, 1] - poses[here, 1]
    for a in range(3):
        moved[0, a] -= dy * moved[2, a]
        moved[1, a] += dx * moved[2, a]
    for a in range(3):
        moved[a, 0] -= dy * moved[a, 2]
        moved[a, 1] += dx * moved[a, 2]
    if there == links.other[link]:
        moved += links.covariances[link]
    assign_rows(covariances[there], moved)
