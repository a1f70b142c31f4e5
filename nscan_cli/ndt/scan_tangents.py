"""Which way what a scan sees runs at one of its points."""

from __future__ import annotations

from nscan_cli.kernels.decorators import leaf_kernel
from nscan_cli.poses import Array

BESIDE = 10
"""Of the points of a scan so many to each side are asked how the wall runs at one of them:"""
LEAST_APART, MOST_APART = 0.1, 0.5
"""the first that is so far (m) off; nearer ones differ by noise, farther ones are of something else."""


@leaf_kernel
def tangent(points: Array, k: int) -> tuple[float, float]:
    """Along what point k of a scan (m, 2) lies on: from the points beside it, or across its beam."""
    x, y = points[k, 0], points[k, 1]
    tx = ty = 0.0
    for step in (-1, 1):
        for beside in range(1, BESIDE + 1):
            other = k + step * beside
            if other < 0 or other >= points.shape[0]:
                break
            dx, dy = points[other, 0] - x, points[other, 1] - y
            apart = dx * dx + dy * dy
            if apart > LEAST_APART * LEAST_APART:
                if apart < MOST_APART * MOST_APART:
                    tx += step * dx
                    ty += step * dy
                break
    if tx == 0.0 and ty == 0.0:
        return -y, x
    return tx, ty
