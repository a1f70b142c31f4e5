"""The NDT by its definition, in plain NumPy: slow, and nothing in common with the kernels."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array, transform

SHIFTS = ((0, 0), (1, 0), (0, 1), (1, 1))
"""The four grids, in halves of a cell."""
Gaussians = dict[tuple[int, int, int, int], tuple[Array, Array, Array]]


def gaussians(points: Array, cell: float, minimum: int, floor: float) -> Gaussians:
    """Grid and cell → mean (2,), Σ⁻¹ (2, 2) and side (2,), from the points (m, 2) that fall into the cell.

    The points are seen from the origin.
    """
    beams = points / np.linalg.norm(points, axis=1)[:, None]
    found: Gaussians = {}
    for shift in SHIFTS:
        cells = _cells(points, shift, cell)
        for at in np.unique(cells, axis=0):
            here = (cells == at).all(axis=1)
            inside = points[here]
            if len(inside) < minimum:
                continue
            values, vectors = np.linalg.eigh(np.cov(inside.T, ddof=0))
            large = max(values[1], floor**2)
            small = max(values[0], floor**2, 0.001 * large)
            inverse = vectors @ np.diag([1 / small, small**2 / large**3]) @ vectors.T
            through = float(beams[here].mean(axis=0) @ vectors[:, 0])
            side = -np.sign(through) * vectors[:, 0] if abs(through) > 0.2 else np.zeros(2)
            found[(*shift, int(at[0]), int(at[1]))] = (inside.mean(axis=0), inverse, side)
    return found


def mahalanobis(found: Gaussians, cell: float, points: Array, pose: Array) -> Array:
    """(m, 4) squared Mahalanobis distances of moved points to the Gaussians of their cells; inf: none.

    There is none either where the beam of a point, from the pose to it, hits a Gaussian from behind.
    """
    moved = transform(pose, points)
    distances = np.full((len(points), 4), np.inf)
    for grid, shift in enumerate(SHIFTS):
        for k, at in enumerate(_cells(moved, shift, cell).tolist()):
            if (*shift, *at) in found:
                mean, inverse, side = found[(*shift, *at)]
                if side @ (moved[k] - pose[:2]) <= 0.0:
                    distances[k, grid] = (moved[k] - mean) @ inverse @ (moved[k] - mean)
    return distances


def lattice(points: Array, pose: Array, half: float) -> Array:
    """(m, 2) the lattice cells of moved points; E is smooth as long as these stay.

    And as long as no beam comes to graze a wall: that is too rare to look for.
    """
    cells: Array = np.floor(transform(pose, points) / half)
    return cells


def _cells(points: Array, shift: tuple[int, int], cell: float) -> Array:
    cells: Array = np.floor((points - 0.5 * cell * np.array(shift)) / cell).astype(np.int64)
    return cells
