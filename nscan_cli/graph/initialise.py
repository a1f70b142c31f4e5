"""A start for graphs whose given poses lie too far from the minimum: rotations first, then positions.

The chordal relaxation: with the rotation of pose i as the complex number r_i = exp(i φ_i), a measured turn
asks for r_b = r_a exp(i θ_ab), which is linear in r; with the rotations known, so are the positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from nscan_cli.graph.model import Pairwise
from nscan_cli.poses import Array, rotated_information


def chordal_start(
    poses: Array, pairwise: Sequence[Pairwise], positions: NDArray[np.int64], fixed: int = 0
) -> Array:
    """Poses (K, 3) from pairwise relations alone, with the pose at place `fixed` kept.

    `positions[id]` is the place of a node. Raises RuntimeError when the relations leave poses unconnected.
    """
    k, p = len(poses), len(pairwise)
    a, b = positions[np.array([relation.nodes for relation in pairwise]).reshape(-1, 2)].T
    z = np.array([relation.measurement for relation in pairwise])
    information = np.array([relation.information for relation in pairwise])
    rows = np.arange(p)
    others = np.delete(np.arange(k), fixed)

    weights = np.sqrt(information[:, 2, 2])
    turns = csr_array(
        (
            np.concatenate([weights, -weights * np.exp(1j * z[:, 2])]),
            (np.concatenate([rows, rows]), np.concatenate([b, a])),
        ),
        shape=(p, k),
    )
    rotations = np.empty(k, dtype=np.complex128)
    rotations[fixed] = np.exp(1j * poses[fixed, 2])
    rotations[others] = _least_squares(turns[:, others], -turns[:, [fixed]] @ rotations[[fixed]])
    start = poses.copy()
    start[others, 2] = np.angle(rotations[others])

    # t_b − t_a = R_a z, weighted by the square root of the information in the global frame.
    frames = start[a]
    roots = np.array(
        [
            np.linalg.cholesky(rotated_information(frame, matrix)[:2, :2]).T
            for frame, matrix in zip(frames, information, strict=True)
        ]
    )
    cos, sin = np.cos(frames[:, 2]), np.sin(frames[:, 2])
    gaps = np.stack([cos * z[:, 0] - sin * z[:, 1], sin * z[:, 0] + cos * z[:, 1]], axis=1)
    right = np.einsum("pij,pj->pi", roots, gaps).ravel()
    row = np.repeat(np.arange(2 * p), 2)
    column_a = (2 * a[:, None, None] + np.arange(2)).repeat(2, axis=1).ravel()
    column_b = (2 * b[:, None, None] + np.arange(2)).repeat(2, axis=1).ravel()
    moves = csr_array(
        (
            np.concatenate([roots.ravel(), -roots.ravel()]),
            (np.concatenate([row, row]), np.concatenate([column_b, column_a])),
        ),
        shape=(2 * p, 2 * k),
    )
    free = (2 * others[:, None] + np.arange(2)).ravel()
    held = np.array([2 * fixed, 2 * fixed + 1])
    solved = _least_squares(moves[:, free], right - moves[:, held] @ poses[fixed, :2])
    start[others, :2] = solved.reshape(-1, 2)
    return start


def _least_squares(matrix: Any, right: Any) -> Any:
    adjoint = matrix.conj().T
    factor = splu((adjoint @ matrix).tocsc(), permc_spec="MMD_AT_PLUS_A")
    return factor.solve(adjoint @ right)
