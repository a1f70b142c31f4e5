"""Small dense matrices inside kernels, where numba's own products would need SciPy."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Array


@leaf_kernel
def multiply(matrix: Array, vector: Array, out: Array) -> None:
    """Write the product (m,) of a matrix (m, n) and a vector (n,)."""
    for i in range(matrix.shape[0]):
        total = 0.0
        for k in range(matrix.shape[1]):
            total += matrix[i, k] * vector[k]
        out[i] = total


@kernel
def inverted(matrix: Array) -> Array:
    """The inverse of a matrix (3, 3) from its cofactors, in a tenth of NumPy's time."""
    inverse = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            i, j, k, m = (a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3
            inverse[b, a] = matrix[i, k] * matrix[j, m] - matrix[i, m] * matrix[j, k]
    determinant = 0.0
    for b in range(3):
        determinant += matrix[0, b] * inverse[b, 0]
    return inverse / determinant


@leaf_kernel
def information_of_place(hessian: Array) -> tuple[float, float, float]:
    """The information (xx, xy, yy), 1/m², on the position of a pose with Hessian (3, 3) and a free angle."""
    turn = max(hessian[2, 2], 1e-9)
    xx = hessian[0, 0] - hessian[0, 2] * hessian[0, 2] / turn
    xy = hessian[0, 1] - hessian[0, 2] * hessian[1, 2] / turn
    yy = hessian[1, 1] - hessian[1, 2] * hessian[1, 2] / turn
    return xx, xy, yy


@leaf_kernel
def solve_definite(matrix: Array, right: Array, out: Array) -> bool:
    """Solve a symmetric positive definite system (m, m) by Cholesky; False when it is not definite.

    Reads the lower triangle of `matrix`, and overwrites it with its factor.
    """
    m = right.shape[0]
    for j in range(m):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        if not pivot > 0.0:
            return False
        matrix[j, j] = np.sqrt(pivot)
        for i in range(j + 1, m):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total / matrix[j, j]
    for i in range(m):
        total = right[i]
        for k in range(i):
            total -= matrix[i, k] * out[k]
        out[i] = total / matrix[i, i]
    for back in range(m):
        i = m - 1 - back
        total = out[i]
        for k in range(i + 1, m):
            total -= matrix[k, i] * out[k]
        out[i] = total / matrix[i, i]
    return True
