"""Sparse Cholesky factorisation of symmetric matrices made of 3 × 3 blocks, one row of blocks a node.

A = LLᵗ in an order of little fill. Columns of blocks lie end to end, the diagonal block first, then
the others in increasing row. The factor tells which directions the matrix does not hold, and gives the
diagonal blocks of the inverse without the rest of it (Takahashi, Fagan, Chin 1973; Erisman, Tinney 1975).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.compiled import kernel
from nscan_cli.graph.pattern import Indices, Pattern
from nscan_cli.poses import Array

LEAST_PIVOT = 1e-12
"""A pivot below this share of the diagonal entry that it comes from counts as none."""
SUSPICIOUS_PIVOT = 1e-6
LEAST_CURVATURE = 1e-15
"""vᵗAv / Σ A_ii v_i² below which nothing holds the direction v: rounding leaves 1e-16, and the bend of an
open chain of 20,000 keyframes has 1e-14."""


class Factor(NamedTuple):
    """L, and the directions that the matrix does not hold."""

    pattern: Pattern
    blocks: Array
    """(B, 3, 3)"""
    loose: NDArray[np.bool_]
    """(F, 3) by row: the pivot was not positive, and the diagonal entry was put in its place."""
    diagonal: Array
    """(F, 3) by row: the diagonal of the matrix."""


def factorise(pattern: Pattern, blocks: Array) -> Factor:
    """The factor of the matrix whose lower triangle is in blocks (B, 3, 3), which are left as they are."""
    factor = blocks.copy()
    diagonal = np.diagonal(blocks[pattern.starts[:-1]], axis1=1, axis2=2)
    loose = np.zeros((len(pattern.place), 3), dtype=np.bool_)
    _factorise(pattern.starts, pattern.rows, factor, loose)
    return Factor(pattern, factor, loose, diagonal)


def solve(factor: Factor, right: Array) -> Array:
    """The solution (F, 3) for a right-hand side (F, 3), both by node."""
    place = factor.pattern.place
    x = np.empty((len(place), 3))
    x[place] = right
    _solve_lower(factor.pattern.starts, factor.pattern.rows, factor.blocks, x)
    _solve_upper(factor.pattern.starts, factor.pattern.rows, factor.blocks, x)
    return x[place]


def loose_nodes(factor: Factor, share: float = 1e-6) -> NDArray[np.bool_]:
    """Which nodes (F,) have a part in a direction that the matrix does not hold.

    Each pivot has its direction v, with Lᵗv = e there and vᵗAv the pivot for v = 1 there. With long levers
    rounding alone makes pivots of 1e-9 of the diagonal, so the directions of all small ones are looked at.
    A node has a part in one when what it adds to Σ A_ii v_i² is not below share² of the largest.
    """
    pattern = factor.pattern
    found = np.zeros(len(pattern.place), dtype=np.bool_)
    pivots = np.diagonal(factor.blocks[pattern.starts[:-1]], axis1=1, axis2=2) ** 2
    for row, component in np.argwhere(factor.loose | (pivots < SUSPICIOUS_PIVOT * factor.diagonal)):
        v = np.zeros((len(found), 3))
        v[row, component] = 1.0
        _solve_upper(pattern.starts, pattern.rows, factor.blocks, v)
        v /= v[row, component]
        part = v**2 * np.where(factor.diagonal > 0, factor.diagonal, 1.0)
        if factor.loose[row, component] or pivots[row, component] < LEAST_CURVATURE * part.sum():
            found |= (part > share**2 * part.max()).any(axis=1)
    return found[pattern.place]


def inverse_diagonal(factor: Factor) -> Array:
    """The diagonal blocks (F, 3, 3) of the inverse, by node; the matrix has to hold every direction."""
    pattern = factor.pattern
    inverse = np.empty_like(factor.blocks)
    _invert_on_pattern(pattern.starts, pattern.rows, factor.blocks, inverse)
    diagonal = inverse[pattern.starts[pattern.place]]
    return 0.5 * (diagonal + diagonal.transpose(0, 2, 1))


@kernel
def _factorise(starts: Indices, rows: Indices, blocks: Array, loose: NDArray[np.bool_]) -> None:
    """Left-looking, in place: column by column, minus what the columns before it bring."""
    nodes = starts.shape[0] - 1
    # first[j]: the columns whose next row to be used is j, linked by `following`; at[k]: where that is.
    first, following, at = np.full(nodes, -1), np.full(nodes, -1), np.zeros(nodes, dtype=np.int64)
    where = np.zeros(nodes, dtype=np.int64)
    for j in range(nodes):
        start, end = starts[j], starts[j + 1]
        for p in range(start, end):
            where[rows[p]] = p
        least = LEAST_PIVOT * np.diag(blocks[start])
        k = first[j]
        while k >= 0:
            after = following[k]
            source = at[k]
            for p in range(source, starts[k + 1]):
                _subtract_product(blocks, where[rows[p]], p, source)
            if source + 1 < starts[k + 1]:
                at[k] = source + 1
                row = rows[source + 1]
                following[k], first[row] = first[row], k
            k = after
        _factorise_block(blocks[start], least, loose[j])
        for p in range(start + 1, end):
            _divide(blocks[p], blocks[start])
        if start + 1 < end:
            at[j] = start + 1
            row = rows[start + 1]
            following[j], first[row] = first[row], j


@kernel
def _subtract_product(blocks: Array, target: int, left: int, right: int) -> None:
    """blocks[target] −= blocks[left] blocks[right]ᵗ"""
    for b in range(3):
        r0, r1, r2 = blocks[right, b, 0], blocks[right, b, 1], blocks[right, b, 2]
        for a in range(3):
            blocks[target, a, b] -= (
                blocks[left, a, 0] * r0 + blocks[left, a, 1] * r1 + blocks[left, a, 2] * r2
            )


@kernel
def _factorise_block(block: Array, least: Array, loose: NDArray[np.bool_]) -> None:
    """Cholesky of one block, in place, with zeros above the diagonal."""
    for a in range(3):
        for b in range(a + 1):
            rest = block[a, b]
            for k in range(b):
                rest -= block[a, k] * block[b, k]
            if b < a:
                block[a, b] = rest / block[b, b]
            elif rest > least[a]:
                block[a, a] = np.sqrt(rest)
            else:
                loose[a] = True
                block[a, a] = np.sqrt(least[a] / LEAST_PIVOT) if least[a] > 0 else 1.0
        for b in range(a + 1, 3):
            block[a, b] = 0.0


@kernel
def _divide(block: Array, lower: Array) -> None:
    """block ← block lower⁻ᵗ"""
    for a in range(3):
        x = block[a, 0] / lower[0, 0]
        y = (block[a, 1] - x * lower[1, 0]) / lower[1, 1]
        z = (block[a, 2] - x * lower[2, 0] - y * lower[2, 1]) / lower[2, 2]
        block[a, 0], block[a, 1], block[a, 2] = x, y, z


@kernel
def _solve_lower(starts: Indices, rows: Indices, blocks: Array, x: Array) -> None:
    for j in range(starts.shape[0] - 1):
        for a in range(3):
            for b in range(a):
                x[j, a] -= blocks[starts[j], a, b] * x[j, b]
            x[j, a] /= blocks[starts[j], a, a]
        for p in range(starts[j] + 1, starts[j + 1]):
            for a in range(3):
                for b in range(3):
                    x[rows[p], a] -= blocks[p, a, b] * x[j, b]


@kernel
def _solve_upper(starts: Indices, rows: Indices, blocks: Array, x: Array) -> None:
    for j in range(starts.shape[0] - 2, -1, -1):
        for p in range(starts[j] + 1, starts[j + 1]):
            for a in range(3):
                for b in range(3):
                    x[j, b] -= blocks[p, a, b] * x[rows[p], a]
        for a in range(2, -1, -1):
            for b in range(a + 1, 3):
                x[j, a] -= blocks[starts[j], b, a] * x[j, b]
            x[j, a] /= blocks[starts[j], a, a]


@kernel
def _invert_on_pattern(starts: Indices, rows: Indices, factor: Array, inverse: Array) -> None:
    """The blocks Z of the inverse where the factor has any, from the last column to the first.

    With M_k = L_kj L_jj⁻¹: Z_ij = −Σ Z_ik M_k and Z_jj = (L_jj L_jjᵗ)⁻¹ − Σ Z_kjᵗ M_k, sums over the rows
    k below j. Any two of these rows share a block of the factor, so all that is needed is there.
    """
    nodes = starts.shape[0] - 1
    where = np.full(nodes, -1)
    m, inverted = np.empty((nodes, 3, 3)), np.zeros((1, 3, 3))
    for j in range(nodes - 1, -1, -1):
        first, end = starts[j] + 1, starts[j + 1]
        inverse[first - 1 : end] = 0.0
        _invert_lower(factor[first - 1], inverted[0])
        m[: end - first] = 0.0
        for p in range(first, end):
            where[rows[p]] = p
            _add_product(m, p - first, factor, p, inverted, 0, 1.0)
        for p in range(first, end):
            column = rows[p]
            _add_product(inverse, p, inverse, starts[column], m, p - first, -1.0)
            for q in range(starts[column] + 1, starts[column + 1]):
                target = where[rows[q]]
                if target >= 0:
                    _add_product(inverse, target, inverse, q, m, p - first, -1.0)
                    _add_transposed_product(inverse, p, inverse, q, m, target - first, -1.0)
        _add_transposed_product(inverse, first - 1, inverted, 0, inverted, 0, 1.0)
        for p in range(first, end):
            _add_transposed_product(inverse, first - 1, inverse, p, m, p - first, -1.0)
            where[rows[p]] = -1


@kernel
def _invert_lower(lower: Array, out: Array) -> None:
    out[0, 0], out[1, 1], out[2, 2] = 1 / lower[0, 0], 1 / lower[1, 1], 1 / lower[2, 2]
    out[1, 0] = -lower[1, 0] * out[0, 0] * out[1, 1]
    out[2, 1] = -lower[2, 1] * out[1, 1] * out[2, 2]
    out[2, 0] = -(lower[2, 0] * out[0, 0] + lower[2, 1] * out[1, 0]) * out[2, 2]


@kernel
def _add_product(out: Array, o: int, left: Array, p: int, right: Array, q: int, factor: float) -> None:
    """out[o] += factor left[p] right[q]"""
    for a in range(3):
        l0, l1, l2 = factor * left[p, a, 0], factor * left[p, a, 1], factor * left[p, a, 2]
        for b in range(3):
            out[o, a, b] += l0 * right[q, 0, b] + l1 * right[q, 1, b] + l2 * right[q, 2, b]


@kernel
def _add_transposed_product(
    out: Array, o: int, left: Array, p: int, right: Array, q: int, factor: float
) -> None:
    """out[o] += factor left[p]ᵗ right[q]"""
    for a in range(3):
        l0, l1, l2 = factor * left[p, 0, a], factor * left[p, 1, a], factor * left[p, 2, a]
        for b in range(3):
            out[o, a, b] += l0 * right[q, 0, b] + l1 * right[q, 1, b] + l2 * right[q, 2, b]
