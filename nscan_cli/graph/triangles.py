"""Symmetric matrices as files keep them: the upper triangle, row by row."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from nscan_cli.poses import Array

# Matrices have few sizes, and to find the places takes longer than to take what is there.
_upper = functools.lru_cache(maxsize=16)(np.triu_indices)


def upper_triangle(matrix: Array) -> Array:
    """The m(m+1)/2 entries on and above the diagonal of a symmetric matrix (m, m), row by row."""
    return matrix[_upper(len(matrix))]


def from_upper_triangle(entries: Sequence[float] | Array, size: int) -> Array:
    """The symmetric matrix (size, size) of its size(size+1)/2 entries on and above the diagonal."""
    matrix = np.zeros((size, size))
    rows, columns = _upper(size)
    matrix[rows, columns] = entries
    matrix[columns, rows] = entries
    return matrix


def is_indefinite(matrix: Array, tolerance: float = 1e-5) -> bool:
    """Whether a symmetric matrix has an eigenvalue below −tolerance times its largest in magnitude.

    The tolerance is for files that keep few digits: it is not an error of theirs to be a little below 0.
    """
    eigenvalues = np.linalg.eigvalsh(matrix)
    return bool(eigenvalues[0] < -tolerance * np.abs(eigenvalues).max())
