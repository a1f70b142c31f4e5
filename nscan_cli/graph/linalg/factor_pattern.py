"""The sparsity pattern of the Cholesky factor of a matrix of 3 × 3 blocks, in a fill-reducing order.

Adjacent columns with blocks in the same rows make a supernode (C. Ashcraft, R. Grimes, "The
influence of relaxed supernode partitions on the multifrontal method", 1989): a dense panel of the factor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Indices


class Pattern(NamedTuple):
    """The blocks of the factor of F nodes, and their places."""

    place: Indices
    """(F,) the row of each node."""
    starts: Indices
    """(F + 1,) where the blocks of each column start."""
    rows: Indices
    """(B,) the row of each block."""
    supernodes: Indices
    """(N + 1,) the first column of each supernode."""
    panels: Indices
    """(N + 1,) where the panel of each supernode starts. It has 9 w h numbers, for w columns and h rows of
    blocks."""


def find_pattern(edges: Indices, nodes: int) -> Pattern:
    """The pattern of the factor of a matrix with blocks at the edges (E, 2) and on its diagonal.

    Edges with a node of −1 are ignored.
    """
    if nodes == 0:
        none = np.zeros(1, np.int64)
        return Pattern(none[:0], none, none[:0], none, none)
    indptr, indices, place = _fill_reducing_order(edges, nodes)
    starts, rows = _fill(indptr, indices, place, np.argsort(place))
    heights = np.diff(starts)
    # Each column from its diagonal down; all at once, as numba takes long to compile a sort.
    firsts = np.repeat(np.arange(nodes) * nodes, heights)
    rows = np.sort(firsts + rows) - firsts
    # A column continues a supernode when it is the first row below the column before, which has one row more.
    next_row = rows[np.minimum(starts[:-1] + 1, len(rows) - 1)]
    continues = (heights[:-1] == heights[1:] + 1) & (next_row[:-1] == np.arange(1, nodes))
    supernodes = np.concatenate([[0], np.flatnonzero(~continues) + 1, [nodes]])
    numbers = 9 * np.diff(supernodes) * heights[supernodes[:-1]]
    return Pattern(place, starts, rows, supernodes, np.concatenate([[0], np.cumsum(numbers)]))


def _fill_reducing_order(edges: Indices, nodes: int) -> tuple[Indices, Indices, Indices]:
    """The neighbours of each node, itself among them, and its row: (indptr, indices, place).

    The order is SuperLU's multiple minimum degree. Its incomplete factorisation drops every entry off the
    diagonal, so that it gives the order of the complete one and does not factorise.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import spilu

    a, b = edges[(edges >= 0).all(axis=1)].T
    each = np.arange(nodes)
    entries = np.concatenate([np.full(2 * len(a), 1e-9), np.ones(nodes)])
    ends = np.concatenate([a, b, each]), np.concatenate([b, a, each])
    matrix = coo_array((entries, ends), shape=(nodes, nodes)).tocsc()
    order = spilu(
        matrix,
        drop_tol=1.0,
        drop_rule="basic",
        fill_factor=1.0,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).perm_c
    return matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), order.astype(np.int64)


def block_targets(edges: Indices, pattern: Pattern) -> Indices:
    """Where the block (row, column) of each edge (E, 2) is stored in the factor's lower triangle.

    2 × the index of the block, + 1 where its transpose is stored; −1 where a node is −1.
    """
    rows, columns = pattern.place[edges].T
    nodes = len(pattern.place)
    blocks = np.repeat(np.arange(nodes), np.diff(pattern.starts)) * nodes + pattern.rows
    indices = np.searchsorted(blocks, np.minimum(rows, columns) * nodes + np.maximum(rows, columns))
    return np.where((edges >= 0).all(axis=1), 2 * indices + (rows < columns), -1)


@kernel
def _fill(indptr: Indices, indices: Indices, place: Indices, order: Indices) -> tuple[Indices, Indices]:
    """(starts, rows) of the factor's columns, each from its diagonal on, but else in no order.

    A column takes over the rows of its children in the elimination tree.
    """
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
            parent = nodes
            for p in range(start + 1, end):
                parent = min(parent, rows[p])
            sibling[j], child[parent] = child[parent], j
    return starts, rows[: starts[nodes]]
