"""The diagonal blocks of the inverse of a sparse matrix, from its factor, without the other blocks.

K. Takahashi, J. Fagan, M.-S. Chen, "Formation of a sparse bus impedance matrix", 1973; A. Erisman, W. Tinney,
"On computing certain elements of the inverse of a sparse matrix", 1975.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import Factor, panel_of, rows_of, subtract_products
from nscan_cli.graph.linalg.factor_pattern import Pattern
from nscan_cli.kernels.array_assignment import assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Array, Indices


def inverse_diagonal(factor: Factor) -> Array:
    """The diagonal blocks (F, 3, 3) of the inverse, by node. The matrix has to be positive definite."""
    pattern = factor.pattern
    diagonal = _invert_on_pattern(pattern, factor.panels)[pattern.place]
    return 0.5 * (diagonal + diagonal.transpose(0, 2, 1))


@kernel
def _invert_on_pattern(pattern: Pattern, factor: Array) -> Array:
    """The diagonal blocks (F, 3, 3) by row. The inverse Z is computed on the factor's pattern only.

    Columns are processed from the last to the first. With M = L_kj L_jj⁻¹ of the rows k below j,
    Z_ij = −Σ Z_ik M_k and Z_jj = (L_jj L_jjᵗ)⁻¹ − Σ Z_kjᵗ M_k. Any two of these rows share a block of the
    factor, so Z is known there. A supernode's columns use the dense matrix of all its rows.
    """
    nodes, count = pattern.place.shape[0], pattern.supernodes.shape[0] - 1
    inverse, diagonal = np.zeros_like(factor), np.zeros((nodes, 3, 3))
    where, owner = np.zeros(nodes, dtype=np.int64), np.zeros(nodes, dtype=np.int64)
    tallest = 0
    for j in range(count):
        owner[pattern.supernodes[j] : pattern.supernodes[j + 1]] = j
        tallest = max(tallest, rows_of(pattern, j).shape[0])
    room = np.zeros(9 * tallest * tallest)
    m = np.zeros((3 * tallest, 3))
    for j in range(count - 1, -1, -1):
        rows, panel = rows_of(pattern, j), panel_of(pattern, factor, j)
        height, width = panel.shape[1], panel.shape[0]
        dense = room[: height * height].reshape(height, height)
        p = width // 3
        while p < rows.shape[0]:
            other = owner[rows[p]]
            others = rows_of(pattern, other)
            for q in range(others.shape[0]):
                where[others[q]] = q
            known, end = panel_of(pattern, inverse, other), pattern.supernodes[other + 1]
            while p < rows.shape[0] and rows[p] < end:
                _gather(known, where, rows, p, dense)
                p += 1
        for column in range(width - 3, -1, -3):
            _invert_columns(panel, column, dense, m)
        found = panel_of(pattern, inverse, j)
        assign_rows(found, dense)
        for p in range(width // 3):
            assign_rows(diagonal[rows[p]], dense[3 * p : 3 * p + 3, 3 * p : 3 * p + 3])
    return diagonal


@leaf_kernel
def _gather(known: Array, where: Indices, rows: Indices, p: int, dense: Array) -> None:
    """Copy the inverse's block column of row p, from row p on, into both triangles of `dense`."""
    column = 3 * where[rows[p]]
    for q in range(p, rows.shape[0]):
        row = 3 * where[rows[q]]
        for b in range(3):
            for a in range(3):
                value = known[column + b, row + a]
                dense[3 * p + b, 3 * q + a] = value
                dense[3 * q + a, 3 * p + b] = value


@leaf_kernel
def _invert_columns(panel: Array, j: int, dense: Array, m: Array) -> None:
    """Compute three columns of the inverse, and their transpose, from the columns after them."""
    height, below = panel.shape[1], j + 3
    # The inverse of the triangular block L_jj.
    i00, i11, i22 = 1.0 / panel[j, j], 1.0 / panel[j + 1, j + 1], 1.0 / panel[j + 2, j + 2]
    i10 = -panel[j, j + 1] * i00 * i11
    i21 = -panel[j + 1, j + 2] * i11 * i22
    i20 = -(panel[j, j + 2] * i00 + panel[j + 1, j + 2] * i10) * i22
    for i in range(below, height):
        u, v, w = panel[j, i], panel[j + 1, i], panel[j + 2, i]
        m[i, 0], m[i, 1], m[i, 2] = u * i00 + v * i10 + w * i20, v * i11 + w * i21, w * i22
        dense[j, i] = dense[j + 1, i] = dense[j + 2, i] = 0.0
    for k in range(below, height, 3):
        subtract_products(m, 0, dense, k, below, dense, j)
    squares = (
        (i00 * i00 + i10 * i10 + i20 * i20, i10 * i11 + i20 * i21, i20 * i22),
        (i10 * i11 + i20 * i21, i11 * i11 + i21 * i21, i21 * i22),
        (i20 * i22, i21 * i22, i22 * i22),
    )
    for a in range(3):
        for i in range(below, height):
            dense[i, j + a] = dense[j + a, i]
        for b in range(3):
            total = squares[a][b]
            for i in range(below, height):
                total -= dense[j + a, i] * m[i, b]
            dense[j + b, j + a] = total
