"""The energy of a graph: all relations' terms, summed into sparse blocks (paper, eqs. (17) and (23))."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.factor_pattern import block_targets, find_pattern
from nscan_cli.graph.optimise.relation_terms import nscan_term, nscan_value
from nscan_cli.graph.optimise.term_cache import TermCache, TermColumns
from nscan_cli.graph.relations.base import Relation
from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, Indices, Mask


class System(NamedTuple):
    """The energy at some poses, and its derivatives with respect to the F free poses, in order."""

    value: float
    """Σ of the terms."""
    terms: Array
    """(Q,) the value of each relation: its χ² at the poses."""
    gradient: Array
    """(F, 3) by node."""
    hessian: Array
    """(B, 3, 3) the lower triangle, on the factor's pattern."""


class GraphEnergy:
    """Evaluates the energy of K poses; the sparsity pattern is computed once."""

    def __init__(
        self,
        nodes: int,
        relations: Sequence[Relation],
        positions: Indices,
        fixed: int = 0,
        terms: TermCache | None = None,
        free: Mask | None = None,
    ) -> None:
        """Take relations between node ids; `positions[id]` is a node's place among the `nodes` poses.

        The pose at place `fixed` is fixed, and so are those that are not `free` (K,), if given. `terms`
        caches the terms of the relations.
        """
        terms = terms or TermCache()
        self.columns = terms.columns(relations, positions)
        self._not_linear = terms.not_linear(relations)
        self.fixed = fixed
        can_move = np.ones(nodes, dtype=np.bool_) if free is None else free.copy()
        can_move[fixed] = False
        self.free: Indices = np.flatnonzero(can_move)
        """(F,) the places of the free poses."""
        self.free_row: Indices = np.full(nodes, -1)
        """(K,) the index of each pose among these; −1 where it is fixed."""
        self.free_row[self.free] = np.arange(len(self.free))
        edges = _block_edges(self.columns, self.free_row)
        self.pattern = find_pattern(edges, len(self.free))
        self._targets = block_targets(edges, self.pattern)

    def weighted(self, weights: Array) -> GraphEnergy:
        """The energy with each relation's term multiplied by its weight (Q,)."""
        other = copy.copy(self)
        other.columns = self.columns._replace(weights=self.columns.weights * weights)
        return other

    def terms(self, poses: Array) -> Array:
        """(Q,) the value of each relation at the poses (K, 3)."""
        poses = np.ascontiguousarray(poses, dtype=np.float64)
        columns = self._columns_at(poses)
        terms = np.zeros(len(columns.fixed))
        _evaluate_values(columns, poses, terms)
        # Values below 0 are rounding errors.
        return np.maximum(terms, 0.0, out=terms)

    def evaluate(self, poses: Array, exact: bool) -> System:
        """Energy, gradient and Hessian (exact, or its Gauss–Newton part) at the poses (K, 3)."""
        poses = np.ascontiguousarray(poses, dtype=np.float64)
        columns = self._columns_at(poses)
        terms = np.zeros(len(columns.fixed))
        gradient = np.zeros((len(poses), 3))
        blocks = np.zeros((len(self.pattern.rows), 3, 3))
        _evaluate(columns, poses, float(exact), self._targets, terms, gradient, blocks)
        np.maximum(terms, 0.0, out=terms)
        return System(float(terms.sum()), terms, gradient[self.free], blocks)

    def _columns_at(self, poses: Array) -> TermColumns:
        """The columns, with the terms that are not linear taken at the poses (K, 3)."""
        columns = self.columns
        if not self._not_linear:
            return columns
        columns = columns._replace(local=columns.local.copy(), hessians=columns.hessians.copy())
        for k, at in self._not_linear:
            nodes = slice(columns.starts[k], columns.starts[k + 1])
            term = at(poses[columns.members[nodes]])
            columns.local[nodes] = term.local
            start = columns.hessian_starts[k]
            columns.hessians[start : start + term.hessian.size] = term.hessian.ravel()
        return columns


@kernel
def _block_edges(columns: TermColumns, free_row: Indices) -> Indices:
    """The blocks of each term's lower triangle, as pairs of rows (E, 2); −1 is a fixed pose."""
    sizes = columns.starts[1:] - columns.starts[:-1]
    edges = np.empty(((sizes * (sizes + 1)).sum() // 2, 2), dtype=np.int64)
    e = 0
    for k in range(columns.fixed.shape[0]):
        members = columns.members[columns.starts[k] : columns.starts[k + 1]]
        for i in range(members.shape[0]):
            for j in range(i + 1):
                edges[e, 0], edges[e, 1] = free_row[members[i]], free_row[members[j]]
                e += 1
    return edges


@kernel
def _evaluate(
    columns: TermColumns,
    poses: Array,
    curvature: float,
    targets: Indices,
    terms: Array,
    gradient: Array,
    blocks: Array,
) -> None:
    """Write each relation's value to terms (Q,), and add its gradient and Hessian to those of its nodes."""
    e = 0
    part, block = np.empty(6), np.empty((6, 6))
    for k in range(columns.fixed.shape[0]):
        start, end = columns.starts[k], columns.starts[k + 1]
        members, m = columns.members[start:end], 3 * (end - start)
        if part.shape[0] != m:
            part, block = np.empty(m), np.empty((m, m))
        begin = columns.hessian_starts[k]
        hessian = columns.hessians[begin : begin + m * m].reshape(m, m)
        terms[k] = nscan_term(
            _poses_of(poses, members),
            columns.local[start:end],
            hessian,
            columns.fixed[k],
            curvature,
            part,
            block,
        )
        weight = columns.weights[k]
        if weight != 1.0:
            terms[k] *= weight
            part *= weight
            block *= weight
        e = _add_term(members, part, block, targets, e, gradient, blocks)


@kernel
def _evaluate_values(columns: TermColumns, poses: Array, terms: Array) -> None:
    """Write each relation's value to terms (Q,)."""
    for k in range(columns.fixed.shape[0]):
        start, end = columns.starts[k], columns.starts[k + 1]
        members, m = columns.members[start:end], 3 * (end - start)
        begin = columns.hessian_starts[k]
        hessian = columns.hessians[begin : begin + m * m].reshape(m, m)
        terms[k] = columns.weights[k] * nscan_value(
            _poses_of(poses, members), columns.local[start:end], hessian, columns.fixed[k]
        )


@kernel
def _poses_of(poses: Array, members: Indices) -> Array:
    """(n, 3) the poses of the members of a relation."""
    gathered = np.empty((members.shape[0], 3))
    for i in range(members.shape[0]):
        for a in range(3):
            gathered[i, a] = poses[members[i], a]
    return gathered


@kernel
def _add_term(
    members: Indices, part: Array, block: Array, targets: Indices, e: int, gradient: Array, blocks: Array
) -> int:
    """Add a term's gradient (3n,) and Hessian (3n, 3n); e counts its blocks, and the next one is returned."""
    for i in range(members.shape[0]):
        for a in range(3):
            gradient[members[i], a] += part[3 * i + a]
        for j in range(i + 1):
            target = targets[e] >> 1
            if targets[e] >= 0:
                for a in range(3):
                    for b in range(3):
                        if targets[e] & 1:
                            blocks[target, b, a] += block[3 * i + a, 3 * j + b]
                        else:
                            blocks[target, a, b] += block[3 * i + a, 3 * j + b]
            e += 1
    return e
