"""Where the factor of a sparse symmetric matrix of 3 × 3 blocks has blocks, in an order of little fill.

Columns that follow each other with blocks in the same rows make a supernode (C. Ashcraft, R. Grimes, "The
influence of relaxed supernode partitions on the multifrontal method", 1989): a dense panel of the factor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.ordering import order_of_little_fill
from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Indices


class Pattern(NamedTuple):
    """Which blocks of the factor of F nodes are there, and where."""

    place: Indices
    """(F,) the row of a node."""
    starts: Indices
    """(F + 1,) where the blocks of each column begin."""
    rows: Indices
    """(B,) the row of each block."""
    supernodes: Indices
    """(N + 1,) the first column of each supernode."""
    panels: Indices
    """(N + 1,) where the panel of each supernode begins: 9 w h numbers, of w columns and h rows of blocks."""


def find_pattern(edges: Indices, nodes: int) -> Pattern:
    """The pattern of the factor when the matrix has blocks at the edges (E, 2), and on its diagonal.

    An edge with a node of −1 is none.
    """
    if nodes == 0:
        none = np.zeros(1, np.int64)
        return Pattern(none[:0], none, none[:0], none, none)
    indptr, indices = _adjacency(edges, nodes)
    place = order_of_little_fill(indptr, indices)
    starts, rows = _fill(indptr, indices, place, np.argsort(place))
    heights = np.diff(starts)
    # The rows of a column are those of the one before, less one, when there are as many and it is the first
    # of them.
    next_row = rows[np.minimum(starts[:-1] + 1, len(rows) - 1)]
    goes_on = (heights[:-1] == heights[1:] + 1) & (next_row[:-1] == np.arange(1, nodes))
    supernodes = np.concatenate([[0], np.flatnonzero(~goes_on) + 1, [nodes]])
    numbers = 9 * np.diff(supernodes) * heights[supernodes[:-1]]
    return Pattern(place, starts, rows, supernodes, np.concatenate([[0], np.cumsum(numbers)]))


@kernel
def block_targets(edges: Indices, pattern: Pattern) -> Indices:
    """Where the block (row, column) of each edge (E, 2) goes among the blocks of the factor's lower triangle.

    2 × its index there, + 1 when it is its transpose that lies there; −1 when a node is −1.
    """
    targets = np.full(edges.shape[0], -1)
    for e in range(edges.shape[0]):
        if edges[e, 0] < 0 or edges[e, 1] < 0:
            continue
        row, column = pattern.place[edges[e, 0]], pattern.place[edges[e, 1]]
        transposed = row < column
        if transposed:
            row, column = column, row
        low, high = pattern.starts[column], pattern.starts[column + 1] - 1
        while low < high:
            middle = (low + high) // 2
            if pattern.rows[middle] < row:
                low = middle + 1
            else:
                high = middle
        targets[e] = 2 * low + transposed
    return targets


@kernel
def _adjacency(edges: Indices, nodes: int) -> tuple[Indices, Indices]:
    """The neighbours of each node, itself among them, increasing: (indptr, indices)."""
    ends = np.ones(nodes, dtype=np.int64)
    for e in range(edges.shape[0]):
        a, b = edges[e, 0], edges[e, 1]
        if a >= 0 and b >= 0 and a != b:
            ends[a] += 1
            ends[b] += 1
    for node in range(1, nodes):
        ends[node] += ends[node - 1]
    # As often as they are named, in any order; then, of each node in order, to its neighbours: sorted.
    starts = np.zeros(nodes + 1, dtype=np.int64)
    for node in range(nodes):
        starts[node + 1] = ends[node]
    at, named = starts[:-1].copy(), np.empty(starts[nodes], dtype=np.int64)
    for node in range(nodes):
        named[at[node]] = node
        at[node] += 1
    for e in range(edges.shape[0]):
        a, b = edges[e, 0], edges[e, 1]
        if a >= 0 and b >= 0 and a != b:
            named[at[a]], named[at[b]] = b, a
            at[a] += 1
            at[b] += 1
    at, indices = starts[:-1].copy(), np.empty_like(named)
    for node in range(nodes):
        for p in range(starts[node], starts[node + 1]):
            other = named[p]
            if at[other] == starts[other] or indices[at[other] - 1] != node:
                indices[at[other]] = node
                at[other] += 1
    indptr = np.zeros(nodes + 1, dtype=np.int64)
    for node in range(nodes):
        begin, count = indptr[node], at[node] - starts[node]
        for p in range(count):
            indices[begin + p] = indices[starts[node] + p]
        indptr[node + 1] = begin + count
    return indptr, indices[: indptr[nodes]].copy()


@kernel
def _fill(indptr: Indices, indices: Indices, place: Indices, order: Indices) -> tuple[Indices, Indices]:
    """The columns of the factor: each takes over the rows of those whose first row it is."""
    nodes = order.shape[0]
    starts = np.zeros(nodes + 1, dtype=np.int64)
    rows = np.empty(4 * indices.shape[0] + 4 * nodes, dtype=np.int64)
    child, sibling, seen = np.empty_like(place), np.empty_like(place), np.empty_like(place)
    for j in range(nodes):
        child[j] = sibling[j] = seen[j] = -1
    for j in range(nodes):
        start = starts[j]
        if rows.shape[0] < start + nodes:
            longer = np.empty(2 * rows.shape[0] + nodes, dtype=np.int64)
            for p in range(start):
                longer[p] = rows[p]
            rows = longer
        end = start + 1
        rows[start] = j
        seen[j] = j
        node = order[j]
        for p in range(indptr[node], indptr[node + 1]):
            row = place[indices[p]]
            if row > j and seen[row] != j:
                seen[row] = j
                rows[end] = row
                end += 1
        k = child[j]
        while k >= 0:
            for p in range(starts[k] + 1, starts[k + 1]):
                row = rows[p]
                if seen[row] != j:
                    seen[row] = j
                    rows[end] = row
                    end += 1
            k = sibling[k]
        starts[j + 1] = end
        if end > start + 1:
            rows[start + 1 : end].sort()
            parent = rows[start + 1]
            sibling[j], child[parent] = child[parent], j
    return starts, rows[: starts[nodes]]
