"""Repair and check of information matrices, which have to be positive semi-definite.

Along an eigenvector with a negative eigenvalue the energy would fall without bound. Small negative
eigenvalues, of matrices from files or matches, are rounding errors and set to 0; larger ones are errors.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array

WRITTEN_ROUNDING = 5e-6
"""Greatest rounding error of the least eigenvalue of a matrix in a file, as a share of the trace. Six
significant digits bound the relative error of each entry by this. In a semi-definite matrix |a_ij| ≤ √(a_ii
a_jj), and the matrix of these bounds has the trace as its one nonzero eigenvalue."""
EIGENVALUE_ROUNDING = 1e-13
"""Greatest error of a computed eigenvalue, as a share of the trace."""


class IndefiniteError(ValueError):
    """A matrix has a negative eigenvalue that rounding does not explain."""

    def __init__(self, index: int, least: float, greatest: float) -> None:
        super().__init__(
            f"has a negative eigenvalue, {least:.3g} beside {greatest:.3g}, which rounding does not explain"
        )
        self.index = index
        """The index of the matrix."""


def semidefinite(matrices: Array) -> Array:
    """Symmetric matrices (Q, m, m) of a file, with negative eigenvalues that are due to rounding set to 0.

    Matrices without negative eigenvalues are returned unchanged. Raises IndefiniteError.
    """
    if _are_definite(matrices):
        return matrices
    eigenvalues = np.linalg.eigvalsh(matrices)
    least, trace = eigenvalues[:, 0], _trace(matrices)
    wrong = np.flatnonzero(least < -WRITTEN_ROUNDING * trace)
    if len(wrong):
        first = int(wrong[0])
        raise IndefiniteError(first, float(least[first]), float(eigenvalues[first, -1]))
    negative = least < -EIGENVALUE_ROUNDING * trace
    if not negative.any():
        return matrices
    matrices = matrices.copy()
    matrices[negative] = _without_negative(matrices[negative])
    return matrices


def as_information(hessians: Array, rounding: float = EIGENVALUE_ROUNDING) -> Array:
    """The Hessians (…, m, m) of matches as information matrices: negative eigenvalues are set to 0.

    Matrices without eigenvalues below −`rounding` times their trace are returned unchanged.
    """
    wrong = np.linalg.eigvalsh(hessians)[..., 0] < -rounding * _trace(hessians)
    if not wrong.any():
        return hessians
    return np.where(wrong[..., None, None], _without_negative(hessians), hessians)


def _without_negative(matrices: Array) -> Array:
    eigenvalues, vectors = np.linalg.eigh(matrices)
    sound: Array = (vectors * np.maximum(eigenvalues, 0.0)[..., None, :]) @ vectors.swapaxes(-1, -2)
    return sound


def _trace(matrices: Array) -> Array:
    """(…,) the traces of matrices (…, m, m), or 0 where they are negative."""
    trace: Array = np.maximum(np.trace(matrices, axis1=-2, axis2=-1), 0.0)
    return trace


def _are_definite(matrices: Array) -> bool:
    """Whether all are positive definite, by Cholesky: it takes a tenth of the time of the eigenvalues."""
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return True
