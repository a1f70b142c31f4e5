"""Sparse Cholesky factorisation A = LLᵗ of symmetric matrices of 3 × 3 blocks, one row of blocks per node.

The order is fill-reducing. The columns of a supernode make a dense panel, which begins with the rows of its
own columns. The factor tells which directions the matrix leaves undetermined.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.factor_pattern import Pattern
from nscan_cli.kernels.decorators import kernel, leaf_kernel, numba_inline_kernel, reduction_kernel
from nscan_cli.poses import Array, Indices, Mask

LEAST_PIVOT = 1e-12
"""A pivot below this share of its diagonal entry counts as 0."""
SUSPICIOUS_PIVOT = 1e-6
"""The directions of pivots below this share of their diagonal entries are checked by their curvature."""
LEAST_CURVATURE = 1e-15
"""A direction v is undetermined where vᵗAv / Σ A_ii v_i² is below this. Rounding leaves 1e-16, and the
bending of an open chain of 20,000 keyframes has 1e-14."""


class Factor(NamedTuple):
    """The factor L, and the pivots that failed."""

    pattern: Pattern
    panels: Array
    """The panels of all supernodes, end to end; entries above the diagonal are 0."""
    loose: Mask
    """(F, 3) by row: whether the pivot was not positive, so that the diagonal entry or more took its
    place."""
    diagonal: Array
    """(F, 3) by row: the diagonal of the matrix."""


def factorise(pattern: Pattern, blocks: Array) -> Factor:
    """The factor of the matrix whose lower triangle is in blocks (B, 3, 3), which stay unchanged."""
    # Of one block it would be a view that cannot be written, and code of its own.
    diagonal = np.diagonal(blocks[pattern.starts[:-1]], axis1=1, axis2=2).copy()
    loose = np.zeros((len(pattern.place), 3), dtype=np.bool_)
    return Factor(pattern, factorise_blocks(pattern, blocks, diagonal, loose), loose, diagonal)


def solve(factor: Factor, right: Array) -> Array:
    """The solution (F, 3) of a right-hand side (F, 3), both by node."""
    place = factor.pattern.place
    x = np.empty((len(place), 3))
    x[place] = right
    flat, gathered = x.reshape(-1), np.empty(x.size)
    solve_lower(factor.pattern, factor.panels, flat, gathered)
    solve_upper(factor.pattern, factor.panels, flat, gathered)
    return x[place]


def undetermined_nodes(factor: Factor, share: float = 1e-6) -> Mask:
    """Which nodes (F,) take part in a direction that the matrix leaves undetermined.

    A pivot belongs to the direction v with Lᵗv = e, scaled so that vᵗAv is the pivot. Rounding alone makes
    pivots of 1e-9 of the diagonal where levers are long, so the directions of all small pivots are checked.
    A node takes part in v where its part of Σ A_ii v_i² exceeds share² times the largest part of a node.
    """
    pattern = factor.pattern
    found = np.zeros(len(pattern.place), dtype=np.bool_)
    pivots = _diagonal(pattern, factor.panels) ** 2
    for row, component in np.argwhere(factor.loose | (pivots < SUSPICIOUS_PIVOT * factor.diagonal)):
        v = np.zeros((len(found), 3))
        v[row, component] = 1.0
        solve_upper(pattern, factor.panels, v.reshape(-1), np.empty(v.size))
        v /= v[row, component]
        part = v**2 * np.where(factor.diagonal > 0, factor.diagonal, 1.0)
        if factor.loose[row, component] or pivots[row, component] < LEAST_CURVATURE * part.sum():
            found |= (part > share**2 * part.max()).any(axis=1)
    return found[pattern.place]


@numba_inline_kernel
def panel_of(pattern: Pattern, panels: Array, supernode: int) -> Array:
    """The panel (3 w, 3 h) of a supernode, its columns of numbers one after the other."""
    width = 3 * (pattern.supernodes[supernode + 1] - pattern.supernodes[supernode])
    return panels[pattern.panels[supernode] : pattern.panels[supernode + 1]].reshape(width, -1)


@numba_inline_kernel
def rows_of(pattern: Pattern, supernode: int) -> Indices:
    """(h,) the rows of blocks of a supernode's panel, its own first."""
    first = pattern.supernodes[supernode]
    return pattern.rows[pattern.starts[first] : pattern.starts[first + 1]]


@kernel
def factorise_blocks(pattern: Pattern, blocks: Array, diagonal: Array, loose: Mask) -> Array:
    """Left-looking factorisation: from each panel, the products of the earlier panels are subtracted."""
    supernodes, starts = pattern.supernodes, pattern.starts
    count, nodes = supernodes.shape[0] - 1, starts.shape[0] - 1
    panels = np.zeros(pattern.panels[count])
    # first[j]: the first of the supernodes whose next row is in j, linked by `following`; at[k]: that row.
    first, following, at = np.full(count, -1), np.full(count, -1), np.zeros(count, dtype=np.int64)
    owner, where = np.zeros(nodes, dtype=np.int64), np.zeros(nodes, dtype=np.int64)
    for j in range(count):
        owner[supernodes[j] : supernodes[j + 1]] = j
    product, least, loose_numbers = np.zeros((3, 3 * nodes)), np.zeros(3 * nodes), loose.reshape(-1)
    for j in range(count):
        begin, end = supernodes[j], supernodes[j + 1]
        rows, panel = rows_of(pattern, j), panel_of(pattern, panels, j)
        for p in range(rows.shape[0]):
            where[rows[p]] = p
        _copy_blocks(blocks[starts[begin] : starts[end]], panel)
        for i in range(panel.shape[0]):
            least[i] = LEAST_PIVOT * panel[i, i]
        k = first[j]
        while k >= 0:
            after, others, other = following[k], rows_of(pattern, k), panel_of(pattern, panels, k)
            source, height = at[k], others.shape[0]
            while source < height and others[source] < end:
                column = 3 * (others[source] - begin)
                _subtract_panel(other, others, source, where, column, panel, product)
                source += 1
            if source < height:
                parent, at[k] = owner[others[source]], source
                following[k], first[parent] = first[parent], k
            k = after
        _factorise_panel(panel, rows, diagonal, least, loose_numbers[3 * begin : 3 * end])
        if rows.shape[0] > end - begin:
            parent, at[j] = owner[rows[end - begin]], end - begin
            following[j], first[parent] = first[parent], j
    return panels


@leaf_kernel
def _copy_blocks(blocks: Array, panel: Array) -> None:
    """Copy the blocks of a supernode's columns of the matrix into its panel."""
    p, height = 0, panel.shape[1] // 3
    for column in range(panel.shape[0] // 3):
        for row in range(column, height):
            for a in range(3):
                for b in range(3):
                    panel[3 * column + b, 3 * row + a] = blocks[p, a, b]
            p += 1


@leaf_kernel
def subtract_products(
    factors: Array, column: int, source: Array, k: int, begin: int, out: Array, target: int
) -> None:
    """out[target + b, i] −= Σ factors[k + a, column + b] source[k + a, i] over a < 3; b < 3, i ≥ `begin`."""
    x0, x1, x2 = factors[k, column], factors[k + 1, column], factors[k + 2, column]
    y0, y1, y2 = factors[k, column + 1], factors[k + 1, column + 1], factors[k + 2, column + 1]
    z0, z1, z2 = factors[k, column + 2], factors[k + 1, column + 2], factors[k + 2, column + 2]
    for i in range(begin, source.shape[1]):
        u, v, w = source[k, i], source[k + 1, i], source[k + 2, i]
        out[target, i] -= x0 * u + x1 * v + x2 * w
        out[target + 1, i] -= y0 * u + y1 * v + y2 * w
        out[target + 2, i] -= z0 * u + z1 * v + z2 * w


@leaf_kernel
def _subtract_panel(
    other: Array, rows: Indices, source: int, where: Indices, column: int, panel: Array, product: Array
) -> None:
    """Subtract the product of an earlier panel from the three columns that are its rows `source`."""
    product[:, 3 * source : other.shape[1]] = 0.0
    for k in range(0, other.shape[0], 3):
        subtract_products(other, 3 * source, other, k, 3 * source, product, 0)
    for p in range(source, rows.shape[0]):
        row = 3 * where[rows[p]]
        for b in range(3):
            for a in range(3):
                panel[column + b, row + a] += product[b, 3 * p + a]


@leaf_kernel
def _factorise_panel(panel: Array, rows: Indices, diagonal: Array, least: Array, loose: Mask) -> None:
    """Factorise a panel three columns at a time; pivots up to `least` are replaced."""
    height = panel.shape[1]
    for j in range(0, panel.shape[0], 3):
        for k in range(0, j, 3):
            subtract_products(panel, j, panel, k, j, panel, j)
        for column in range(j, j + 3):
            for k in range(j, column):
                factor = panel[k, column]
                for i in range(column, height):
                    panel[column, i] -= factor * panel[k, i]
            pivot = panel[column, column]
            if pivot > least[column]:
                pivot = np.sqrt(pivot)
            else:
                loose[column] = True
                pivot = _substitute_pivot(panel, rows, diagonal, least[column] / LEAST_PIVOT, column)
            for i in range(column + 1, height):
                panel[column, i] /= pivot
            panel[column, column] = pivot
            panel[column, j:column] = 0.0


@leaf_kernel
def _substitute_pivot(panel: Array, rows: Indices, diagonal: Array, own: float, column: int) -> float:
    """The square root of the replacement of a pivot: the matrix's diagonal entry, or more.

    It keeps each entry of L below the root of the diagonal entry of its row, as in a positive matrix. Without
    it, the entries of a matrix that is indefinite by rounding would grow from column to column.
    P. Gill, W. Murray, "Newton-type methods for unconstrained and linearly constrained optimization", 1974.
    """
    square = own if own > 0.0 else 1.0
    for i in range(column + 1, panel.shape[1]):
        bound = diagonal[rows[i // 3], i % 3]
        if bound > 0.0:
            square = max(square, panel[column, i] ** 2 / bound)
    return float(np.sqrt(square))


@leaf_kernel
def solve_lower(pattern: Pattern, panels: Array, x: Array, gathered: Array) -> None:
    """Solve L y = x in place. x and the buffer `gathered` are (3 F,) by row."""
    for j in range(pattern.supernodes.shape[0] - 1):
        rows, panel = rows_of(pattern, j), panel_of(pattern, panels, j)
        width, height, begin = panel.shape[0], panel.shape[1], 3 * rows[0]
        for i in range(height):
            gathered[i] = x[begin + i] if i < width else 0.0
        for k in range(0, width, 3):
            u = gathered[k] / panel[k, k]
            v = (gathered[k + 1] - panel[k, k + 1] * u) / panel[k + 1, k + 1]
            w = gathered[k + 2] - panel[k, k + 2] * u - panel[k + 1, k + 2] * v
            w /= panel[k + 2, k + 2]
            gathered[k], gathered[k + 1], gathered[k + 2] = u, v, w
            for i in range(k + 3, height):
                gathered[i] -= panel[k, i] * u + panel[k + 1, i] * v + panel[k + 2, i] * w
        for i in range(width):
            x[begin + i] = gathered[i]
        for p in range(width // 3, rows.shape[0]):
            for a in range(3):
                x[3 * rows[p] + a] += gathered[3 * p + a]


@leaf_kernel
def solve_upper(pattern: Pattern, panels: Array, x: Array, gathered: Array) -> None:
    """Solve Lᵗ y = x in place, as solve_lower."""
    for j in range(pattern.supernodes.shape[0] - 2, -1, -1):
        rows, panel = rows_of(pattern, j), panel_of(pattern, panels, j)
        for p in range(rows.shape[0]):
            for a in range(3):
                gathered[3 * p + a] = x[3 * rows[p] + a]
        for k in range(panel.shape[0] - 3, -1, -3):
            u, v, w = _dots(panel, k, gathered)
            w = (gathered[k + 2] - w) / panel[k + 2, k + 2]
            v = (gathered[k + 1] - v - panel[k + 1, k + 2] * w) / panel[k + 1, k + 1]
            u = (gathered[k] - u - panel[k, k + 1] * v - panel[k, k + 2] * w) / panel[k, k]
            gathered[k], gathered[k + 1], gathered[k + 2] = u, v, w
        for i in range(panel.shape[0]):
            x[3 * rows[0] + i] = gathered[i]


@reduction_kernel
def _dots(panel: Array, k: int, x: Array) -> tuple[float, float, float]:
    """The products of three columns, below their diagonal block, with x."""
    u, v, w = 0.0, 0.0, 0.0
    for i in range(k + 3, panel.shape[1]):
        u += panel[k, i] * x[i]
        v += panel[k + 1, i] * x[i]
        w += panel[k + 2, i] * x[i]
    return u, v, w


@kernel
def _diagonal(pattern: Pattern, panels: Array) -> Array:
    """(F, 3) the diagonal of the factor, by row."""
    diagonal = np.empty((pattern.place.shape[0], 3))
    for j in range(pattern.supernodes.shape[0] - 1):
        rows, panel = rows_of(pattern, j), panel_of(pattern, panels, j)
        for column in range(panel.shape[0]):
            diagonal[rows[column // 3], column % 3] = panel[column, column]
    return diagonal
