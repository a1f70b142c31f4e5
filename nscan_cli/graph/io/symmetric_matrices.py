"""Symmetric matrices as upper triangles, row by row, as in files."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from nscan_cli.poses import Array

# Matrices have few sizes, and computing the indices takes longer than taking the entries.
upper_indices = functools.lru_cache(maxsize=32)(np.triu_indices)


def upper_triangle(matrix: Array) -> Array:
    """The m(m+1)/2 entries on and above the diagonal of a symmetric matrix (m, m), row by row."""
    return matrix[upper_indices(len(matrix))]


def from_upper_triangle(entries: Sequence[float] | Array, size: int) -> Array:
    """The symmetric matrices (…, size, size) of their size(size+1)/2 entries on and above the diagonal."""
    entries = np.asarray(entries, dtype=np.float64)
    matrices = np.zeros((*entries.shape[:-1], size, size))
    rows, columns = upper_indices(size)
    matrices[..., rows, columns] = entries
    matrices[..., columns, rows] = entries
    return matrices
