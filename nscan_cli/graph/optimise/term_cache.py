"""The terms of a graph's relations as columns, cached while the graph grows.

A growing graph builds its energy anew for each of its states, with few new relations each time. The terms of
a relation are stored once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.relations.base import Relation, Term
from nscan_cli.poses import Array, Indices


class TermColumns(NamedTuple):
    """The terms of Q relations as columns for the kernels; nodes are places 0 … K − 1."""

    starts: Indices
    """(Q + 1,) where the nodes of each relation start."""
    members: Indices
    """(Σ n,) the nodes of the relations."""
    local: Array
    """(Σ n, 3) their local poses."""
    hessian_starts: Indices
    """(Q,) where the 9 n² entries of each H start."""
    hessians: Array
    """The entries of all H, also of relations that are not among the Q."""
    fixed: Indices
    """(Q,) the index of pose c among the nodes of each relation."""
    weights: Array
    """(Q,) factors on the terms."""


class TermCache:
    """The terms of all relations asked for so far; relations are identified as objects."""

    def __init__(self) -> None:
        self._relations: list[Relation] = []
        self._slots: dict[int, int] = {}
        self._sizes, self._fixed = np.zeros((2, 0), dtype=np.int64)
        self._nodes, self._local = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        self._hessians = np.zeros(0)
        self._used = 0
        self._at: dict[int, Callable[[Array], Term]] = {}

    def columns(self, relations: Sequence[Relation], positions: Indices) -> TermColumns:
        """The columns of Q relations; `positions[id]` is the place of a node, −1 where it has none.

        Raises ValueError where a relation has a node without a place.
        """
        slots = self._slots_of(relations)
        sizes = self._sizes[slots]
        starts, every = _starts(sizes), _starts(self._sizes)
        entries = np.arange(starts[-1]) + np.repeat(every[slots] - starts[:-1], sizes)
        members = positions[self._nodes[entries]]
        if members.min(initial=0) < 0:
            node = self._nodes[entries][int(np.argmin(members))]
            raise ValueError(f"a relation has node {node}, which is not a keyframe of this energy")
        return TermColumns(
            starts=starts,
            members=members,
            local=self._local[entries],
            hessian_starts=_starts(9 * self._sizes**2)[slots],
            hessians=self._hessians,
            fixed=self._fixed[slots],
            weights=np.ones(len(slots)),
        )

    def not_linear(self, relations: Sequence[Relation]) -> list[tuple[int, Callable[[Array], Term]]]:
        """The relations (Q) whose terms depend on the poses: (index, Term.at). Call `columns` first."""
        if not self._at:
            return []
        slots = [self._slots[id(relation)] for relation in relations]
        return [(k, self._at[slot]) for k, slot in enumerate(slots) if slot in self._at]

    def _slots_of(self, relations: Sequence[Relation]) -> Indices:
        slots = list(map(self._slots.get, map(id, relations)))
        if None in slots:
            self._add([relation for relation, slot in zip(relations, slots, strict=True) if slot is None])
            slots = list(map(self._slots.get, map(id, relations)))
        return np.array(slots, dtype=np.int64)

    def _add(self, relations: Sequence[Relation]) -> None:
        terms = [relation.term() for relation in relations]
        for slot, (relation, term) in enumerate(zip(relations, terms, strict=True), len(self._relations)):
            self._slots[id(relation)] = slot
            if term.at is not None:
                self._at[slot] = term.at
        self._relations.extend(relations)
        nodes = [node for relation in relations for node in relation.nodes]
        sizes = [len(relation.nodes) for relation in relations]
        self._sizes = np.append(self._sizes, np.array(sizes, dtype=np.int64))
        self._fixed = np.append(self._fixed, np.array([term.fixed for term in terms], dtype=np.int64))
        self._nodes = np.append(self._nodes, np.array(nodes, dtype=np.int64))
        self._local = np.concatenate([self._local, *(term.local for term in terms)])
        self._append(np.concatenate([term.hessian.ravel() for term in terms]))

    def _append(self, hessians: Array) -> None:
        begin, self._used = self._used, self._used + len(hessians)
        if self._used > len(self._hessians):
            # Earlier energies keep their array.
            longer = np.empty(max(self._used, 2 * begin))
            longer[:begin] = self._hessians[:begin]
            self._hessians = longer
        self._hessians[begin : self._used] = hessians


def _starts(sizes: Indices) -> Indices:
    """(Q + 1,) where each of Q parts starts, end to end."""
    starts = np.zeros(len(sizes) + 1, dtype=np.int64)
    np.cumsum(sizes, out=starts[1:])
    return starts
