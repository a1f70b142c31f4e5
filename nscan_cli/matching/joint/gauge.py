"""Newton's step of n poses that are free to move as a whole: the choice of the gauge (paper, III-D)."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.damped_newton import JOINT_STEPS
from nscan_cli.matching.small_matrices import solve_definite
from nscan_cli.poses import Array

FREE_GAUGE = -1
"""Stands for the index of the fixed scan where no scan is fixed."""


def gauge_of(fixed: int | None) -> int:
    """The fixed scan as the kernels take it; None leaves the gauge free."""
    return FREE_GAUGE if fixed is None else fixed


@kernel
def gauge_fixed_step(
    gradient: Array, hessian: Array, poses: Array, damping: float, fixed: int, step: Array
) -> bool:
    """Write the step (n, 3) that solves (H + damping · diag H) Δp = −g, eq. (5), in the chosen gauge (III-D).

    `fixed` is the index of the scan that stays. If it is FREE_GAUGE, the step is the shortest one, with no
    part along the three null directions. Returns whether the matrix is positive definite.
    """
    size = gradient.shape[0]
    matrix, right, solution = hessian.copy(), -gradient, np.empty(size)
    greatest = 0.0
    for a in range(size):
        greatest = max(greatest, abs(hessian[a, a]))
    for a in range(size):
        matrix[a, a] += damping * abs(hessian[a, a]) + JOINT_STEPS.floor_share * greatest + JOINT_STEPS.floor
    if fixed < 0:
        null = gauge_directions(poses)
        for a in range(size):
            for b in range(a + 1):
                along = null[a, 0] * null[b, 0] + null[a, 1] * null[b, 1] + null[a, 2] * null[b, 2]
                matrix[a, b] += greatest * along
    else:
        for a in range(3 * fixed, 3 * fixed + 3):
            for b in range(size):
                matrix[a, b] = matrix[b, a] = 0.0
            matrix[a, a], right[a] = 1.0, 0.0
    if not solve_definite(matrix, right, solution):
        return False
    assign_rows(step, solution.reshape(-1, 3))
    return True


@kernel
def gauge_directions(poses: Array) -> Array:
    """An orthonormal basis (3n, 3) of the global motions, which do not change the energy."""
    n = poses.shape[0]
    directions = np.zeros((3 * n, 3))
    mean_x = mean_y = squares = 0.0
    for i in range(n):
        mean_x += poses[i, 0] / n
        mean_y += poses[i, 1] / n
    for i in range(n):
        squares += (poses[i, 0] - mean_x) ** 2 + (poses[i, 1] - mean_y) ** 2
    # A rotation about the centre is orthogonal to the translations.
    along, turn = np.sqrt(n), np.sqrt(n + squares)
    for i in range(n):
        x, y = poses[i, 0] - mean_x, poses[i, 1] - mean_y
        directions[3 * i, 0] = directions[3 * i + 1, 1] = 1.0 / along
        directions[3 * i, 2], directions[3 * i + 1, 2] = -y / turn, x / turn
        directions[3 * i + 2, 2] = 1.0 / turn
    return directions
