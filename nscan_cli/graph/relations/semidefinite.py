"""Information matrices are positive semi-definite: a negative eigenvalue is rounding, or an error.

The energy of a direction with a negative eigenvalue falls for ever. Where information comes from a file, or
from a match, it becomes sound here, and no energy is below 0.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array

WRITTEN_ROUNDING = 5e-6
"""Files keep six significant digits: an entry is off by so much of itself at most, and the least eigenvalue
by so much of the trace. (In a semi-definite matrix no |a_ij| is above √(a_ii a_jj), and the matrix of these
has one eigenvalue besides 0, its trace.) Six decimals are no fewer digits where entries are above 1."""
EIGENVALUE_ROUNDING = 1e-13
"""Eigenvalues are computed to so much of the trace."""


class IndefiniteError(ValueError):
    """A matrix has an eigenvalue below 0 that rounding does not explain."""

    def __init__(self, index: int, least: float, greatest: float) -> None:
        super().__init__(
            f"has a negative eigenvalue, {least:.3g} beside {greatest:.3g}, which rounding does not explain"
        )
        self.index = index
        """Which one of the matrices."""


def semidefinite(matrices: Array) -> Array:
    """Symmetric matrices (Q, m, m) as they were written, with 0 for what rounding has made negative.

    Those without a negative eigenvalue are the same, bit for bit. Raises IndefiniteError.
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
    """The Hessians (…, m, m) of matches as the information that they are: where one curves down, none.

    Those that have no eigenvalue below 0 but for `rounding` (of their trace) are the same, bit for bit.
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
    """(…,) that of matrices (…, m, m), or 0 where it is negative."""
    trace: Array = np.maximum(np.trace(matrices, axis1=-2, axis2=-1), 0.0)
    return trace


def _are_definite(matrices: Array) -> bool:
    """Whether all are positive definite for certain, which takes a tenth of the time of eigenvalues."""
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return True
