"""The direction of the surface that a scan sees at one of its points."""

from __future__ import annotations

from nscan_cli.kernels.decorators import leaf_kernel
from nscan_cli.poses import Array

NEIGHBOUR_POINTS = 10
"""Most points to each side that are tried as the neighbour. These are constants of the kernels."""
LEAST_SPACING, GREATEST_SPACING = 0.1, 0.5
"""Distances (m) of the neighbour: nearer points differ by noise, farther ones belong to something else."""


@leaf_kernel
def scan_tangent(points: Array, k: int) -> tuple[float, float]:
    """The direction of the surface at point k of a scan (m, 2), from its neighbours; else across its beam."""
    x, y = points[k, 0], points[k, 1]
    tx = ty = 0.0
    for step in (-1, 1):
        for beside in range(1, NEIGHBOUR_POINTS + 1):
            other = k + step * beside
            if other < 0 or other >= points.shape[0]:
                break
            dx, dy = points[other, 0] - x, points[other, 1] - y
            apart = dx * dx + dy * dy
            if apart > LEAST_SPACING * LEAST_SPACING:
                if apart < GREATEST_SPACING * GREATEST_SPACING:
                    tx += step * dx
                    ty += step * dy
                break
    if tx == 0.0 and ty == 0.0:
        return -y, x
    return tx, ty
