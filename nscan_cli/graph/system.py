"""The energy of a whole graph as sparse arrays: all relations' terms summed (paper, eqs. (17) and (23))."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from nscan_cli.compiled import kernel
from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.terms import nscan_term, pairwise_term
from nscan_cli.poses import Array

Indices = NDArray[np.int64]


class Columns(NamedTuple):
    """P pairwise and Q nScan relations as columns for the kernels; nodes are positions 0 … K − 1."""

    pairs: Indices
    """(P, 2)"""
    measurements: Array
    """(P, 3)"""
    information: Array
    """(P, 3, 3)"""
    starts: Indices
    """(Q + 1,) where the nodes of each nScan relation begin."""
    members: Indices
    """(Σ n,)"""
    local: Array
    """(Σ n, 3)"""
    hessian_starts: Indices
    """(Q + 1,)"""
    hessians: Array
    """(Σ 9 n²,)"""
    fixed: Indices
    """(Q,)"""


class System(NamedTuple):
    """The graph's energy at some poses, with the variables of the fixed node left out."""

    value: float
    terms: Array
    """(P + Q,) what each relation gives: χ² at the poses."""
    gradient: Array
    """(3 K − 3,)"""
    hessian: csc_array
    """(3 K − 3, 3 K − 3)"""


class GraphEnergy:
    """Evaluates the energy of K poses; the sparsity pattern is found once."""

    def __init__(
        self,
        nodes: int,
        pairwise: Sequence[Pairwise],
        nscan: Sequence[NScan],
        positions: Indices,
        fixed: int = 0,
    ) -> None:
        """Take relations between node ids; `positions[id]` is a node's place among the `nodes` poses.

        The pose at place `fixed` is held where it is.
        """
        self.columns = _columns(pairwise, nscan, positions)
        self.size = nodes
        self.kept = np.delete(np.arange(3 * nodes), slice(3 * fixed, 3 * fixed + 3))
        self._find_pattern(nodes, fixed)

    def value(self, poses: Array) -> float:
        """The energy alone at the poses (K, 3)."""
        return self.evaluate(poses, exact=False).value

    def evaluate(self, poses: Array, exact: bool) -> System:
        """Energy, gradient and Hessian (exact, or its Gauss–Newton part) at the poses (K, 3)."""
        columns = self.columns
        terms = np.zeros(len(columns.pairs) + len(columns.fixed))
        gradient = np.zeros(3 * self.size)
        values = np.empty(36 * len(columns.pairs) + len(columns.hessians))
        _evaluate(columns, np.ascontiguousarray(poses), float(exact), terms, gradient, values)
        data = np.bincount(self._slots, weights=values[self._entries], minlength=len(self._indices))
        m = len(self.kept)
        hessian = csc_array((data, self._indices, self._indptr), shape=(m, m))
        return System(float(terms.sum()), terms, gradient[self.kept], hessian)

    def _find_pattern(self, nodes: int, fixed: int) -> None:
        columns = self.columns
        rows, cols = [], []
        for group in _members_of_equal_size(columns):
            variables = (3 * group[:, :, None] + np.arange(3)).reshape(len(group), -1)
            m = variables.shape[1]
            rows.append(np.repeat(variables, m, axis=1).ravel())
            cols.append(np.tile(variables, (1, m)).ravel())
        row, col = np.concatenate(rows), np.concatenate(cols)
        reduced = np.full(3 * nodes, -1)
        reduced[self.kept] = np.arange(len(self.kept))
        row, col = reduced[row], reduced[col]
        self._entries = np.flatnonzero((row >= 0) & (col >= 0))
        m = len(self.kept)
        keys, self._slots = np.unique(col[self._entries] * m + row[self._entries], return_inverse=True)
        self._indices = (keys % m).astype(np.int32)
        self._indptr = np.searchsorted(keys, np.arange(m + 1) * m).astype(np.int32)


def _members_of_equal_size(columns: Columns) -> list[Indices]:
    """The nodes of the relations in their order, as blocks (relations, n) of runs of one n."""
    groups = [columns.pairs] if len(columns.pairs) else []
    sizes = np.diff(columns.starts)
    run = 0
    while run < len(sizes):
        end = run
        while end < len(sizes) and sizes[end] == sizes[run]:
            end += 1
        groups.append(columns.members[columns.starts[run] : columns.starts[end]].reshape(end - run, -1))
        run = end
    return groups


def _columns(pairwise: Sequence[Pairwise], nscan: Sequence[NScan], positions: Indices) -> Columns:
    sizes = [len(relation.nodes) for relation in nscan]
    return Columns(
        pairs=positions[np.array([r.nodes for r in pairwise], dtype=np.int64).reshape(-1, 2)],
        measurements=np.array([r.measurement for r in pairwise], dtype=np.float64).reshape(-1, 3),
        information=np.array([r.information for r in pairwise], dtype=np.float64).reshape(-1, 3, 3),
        starts=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        members=positions[np.array([node for r in nscan for node in r.nodes], dtype=np.int64)],
        local=np.concatenate([r.poses for r in nscan]) if nscan else np.empty((0, 3)),
        hessian_starts=np.concatenate([[0], np.cumsum([9 * n * n for n in sizes])]).astype(np.int64),
        hessians=np.concatenate([r.hessian.ravel() for r in nscan]) if nscan else np.empty(0),
        fixed=np.array([r.fixed for r in nscan], dtype=np.int64),
    )


@kernel
def _evaluate(
    columns: Columns, poses: Array, curvature: float, terms: Array, gradient: Array, values: Array
) -> None:
    """Each relation's value into terms (P + Q,), its gradient added, its Hessian laid into values."""
    pairs = columns.pairs.shape[0]
    part6, block6 = np.empty(6), np.empty((6, 6))
    for k in range(pairs):
        a, b = columns.pairs[k, 0], columns.pairs[k, 1]
        terms[k] = pairwise_term(
            poses[a], poses[b], columns.measurements[k], columns.information[k], curvature, part6, block6
        )
        gradient[3 * a : 3 * a + 3] += part6[:3]
        gradient[3 * b : 3 * b + 3] += part6[3:]
        values[36 * k : 36 * k + 36] = block6.ravel()
    for k in range(columns.fixed.shape[0]):
        start, end = columns.starts[k], columns.starts[k + 1]
        m = 3 * (end - start)
        members = columns.members[start:end]
        part, block = np.empty(m), np.empty((m, m))
        hessian = columns.hessians[columns.hessian_starts[k] : columns.hessian_starts[k + 1]].reshape(m, m)
        terms[pairs + k] = nscan_term(
            poses[members], columns.local[start:end], hessian, columns.fixed[k], curvature, part, block
        )
        for i in range(members.shape[0]):
            for a in range(3):
                gradient[3 * members[i] + a] += part[3 * i + a]
        offset = 36 * pairs + columns.hessian_starts[k]
        values[offset : offset + m * m] = block.ravel()
