"""Newton's step of n poses whose common place is open: a gauge is chosen for it (paper, III-D)."""

from __future__ import annotations

import numpy as np

from nscan_cli.compiled import kernel
from nscan_cli.matching.linear import solve_definite
from nscan_cli.poses import Array

FREE = -1
"""In place of a fixed scan: the gauge is free."""


def gauge_of(fixed: int | None) -> int:
    """The gauge in which a scan stays where it is, as the kernels take it; None leaves it free."""
    return FREE if fixed is None else fixed


@kernel
def newton_step(
    gradient: Array, hessian: Array, poses: Array, damping: float, fixed: int, step: Array
) -> bool:
    """Write the step (n, 3) that solves (H + damping · diag H) Δp = −g, eq. (5), in the chosen gauge (III-D).

    With `fixed` −1 the step is the smallest one: without any part along the three null directions. False
    when the matrix is not positive definite.
    """
    size = gradient.shape[0]
    matrix, right, solution = hessian.copy(), -gradient, np.empty(size)
    diagonal = np.abs(np.diag(hessian))
    greatest = diagonal.max()
    for a in range(size):
        matrix[a, a] += damping * diagonal[a] + 1e-9 * greatest + 1e-12
    if fixed < 0:
        null = gauge_directions(poses)
        matrix += greatest * (null @ null.T)
    else:
        for a in range(3 * fixed, 3 * fixed + 3):
            matrix[a, :] = 0.0
            matrix[:, a] = 0.0
            matrix[a, a], right[a] = 1.0, 0.0
    if not solve_definite(matrix, right, solution):
        return False
    step[:, :] = solution.reshape(step.shape)
    return True


@kernel
def gauge_directions(poses: Array) -> Array:
    """An orthonormal basis (3n, 3) of the global motions that leave the energy as it is."""
    n = poses.shape[0]
    directions = np.zeros((3 * n, 3))
    x, y = poses[:, 0] - poses[:, 0].mean(), poses[:, 1] - poses[:, 1].mean()
    # About the centre a turn is orthogonal to the shifts.
    along, turn = np.sqrt(n), np.sqrt(n + (x * x).sum() + (y * y).sum())
    for i in range(n):
        directions[3 * i, 0] = directions[3 * i + 1, 1] = 1.0 / along
        directions[3 * i, 2], directions[3 * i + 1, 2] = -y[i] / turn, x[i] / turn
        directions[3 * i + 2, 2] = 1.0 / turn
    return directions
