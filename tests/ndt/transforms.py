"""What tests ask of a normal distributions transform."""

from __future__ import annotations

import numpy as np

from nscan_cli.ndt.grid_growth import change_points
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array


def gaussian_count(ndt: Ndt) -> int:
    """The number of Gaussians with enough points; two where a wall has two faces."""
    return int(np.count_nonzero(ndt.grid.gaussians[:, 2]))


def subtract(ndt: Ndt, points: Array, pose: Array) -> None:
    """Remove points (m, 2) that were added with the same pose (3,)."""
    ndt.reserve(len(points))
    ndt.rows = change_points(ndt.grid, ndt.rows, ndt.half, points, pose, -1.0, True)


def entries(ndt: Ndt) -> dict[int, tuple[float, ...]]:
    """Key → Gaussian, of all with enough points."""
    grid = ndt.grid
    return {
        int(grid.keys[row]): tuple(grid.gaussians[row])
        for row in range(ndt.rows)
        if grid.gaussians[row, 2] > 0
    }


def assert_same(a: Ndt, b: Ndt, tolerance: float = 1e-9) -> None:
    first, second = entries(a), entries(b)
    assert first.keys() == second.keys()
    for key, gaussian in first.items():
        np.testing.assert_allclose(gaussian, second[key], rtol=tolerance, atol=tolerance)


def ndt_of(points: Array, cell: float = 1.0) -> Ndt:
    ndt = Ndt.empty(GaussianOptions(cell, 3))
    ndt.add(points, np.zeros(3))
    return ndt
