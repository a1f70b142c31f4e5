"""Minimise the energy of one scan against one NDT: damped Newton steps in stages (paper, III-C, III-F).

The objective is scale · E(u) + ½ (u − z)ᵗ P (u − z), with the prior (14) of mean z and information P. The
stages widen the Gaussians less and less; far from the optimum the steps use the semi-definite part of the
Hessian, because the exact one need not be positive there.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.compiled import kernel
from nscan_cli.ndt.energy import accumulate, unpack
from nscan_cli.ndt.grid import Grid
from nscan_cli.poses import Array

FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-7
GREATEST_DAMPING = 1e6


@kernel
def objective(
    grid: Grid,
    half: float,
    points: Array,
    pose: Array,
    scale: float,
    prior_mean: Array,
    prior_information: Array,
    widening: float,
    curvature: float,
    out: Array,
    gradient: Array,
    hessian: Array,
) -> float:
    """The objective at `pose`; writes its gradient (3,) and Hessian (3, 3), and E's own into out (10,)."""
    accumulate(grid, half, points, pose[0], pose[1], pose[2], widening, curvature, 0.0, out)
    unpack(out, scale, gradient, hessian)
    value = scale * out[0]
    turn = pose[2] - prior_mean[2]
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    for a in range(3):
        pull = 0.0
        for b in range(3):
            difference = turn if b == 2 else pose[b] - prior_mean[b]
            pull += prior_information[a, b] * difference
            hessian[a, b] += prior_information[a, b]
        gradient[a] += pull
        value += 0.5 * pull * (turn if a == 2 else pose[a] - prior_mean[a])
    return float(value)


@kernel
def solve3(matrix: Array, right: Array, out: Array) -> bool:
    """Solve a symmetric positive definite 3 × 3 system by Cholesky; False when it is not definite."""
    if matrix[0, 0] <= 0.0:
        return False
    l00 = np.sqrt(matrix[0, 0])
    l10, l20 = matrix[1, 0] / l00, matrix[2, 0] / l00
    rest = matrix[1, 1] - l10 * l10
    if rest <= 0.0:
        return False
    l11 = np.sqrt(rest)
    l21 = (matrix[2, 1] - l20 * l10) / l11
    rest = matrix[2, 2] - l20 * l20 - l21 * l21
    if rest <= 0.0:
        return False
    l22 = np.sqrt(rest)
    y0 = right[0] / l00
    y1 = (right[1] - l10 * y0) / l11
    y2 = (right[2] - l20 * y0 - l21 * y1) / l22
    out[2] = y2 / l22
    out[1] = (y1 - l21 * out[2]) / l11
    out[0] = (y0 - l10 * out[1] - l20 * out[2]) / l00
    return True


@kernel
def minimise(
    grid: Grid,
    half: float,
    points: Array,
    pose: Array,
    scale: float,
    prior_mean: Array,
    prior_information: Array,
    widenings: Array,
    max_iterations: int,
    tolerance: float,
    hessian: Array,
) -> tuple[float, float, int, int, bool]:
    """Levenberg–Marquardt from `pose` (3,), in place, one stage for each entry of `widenings`.

    A stage ends when a step moves the pose by less than `tolerance` (m, rad). Writes the last stage's
    semi-definite Hessian of the objective (3, 3). Returns the objective's and E's value, iterations,
    evaluations, and whether the last stage converged.
    """
    out, trial_out = np.empty(10), np.empty(10)
    gradient, step, trial = np.empty(3), np.empty(3), np.empty(3)
    trial_gradient, trial_hessian, damped = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    value, iterations, evaluations, converged = 0.0, 0, 0, False
    for stage in range(widenings.shape[0]):
        widening = widenings[stage]
        value = objective(grid, half, points, pose, scale, prior_mean, prior_information,
                          widening, 0.0, out, gradient, hessian)  # fmt: skip
        evaluations += 1
        damping = FIRST_DAMPING
        converged = False
        for _ in range(max_iterations):
            iterations += 1
            for a in range(3):
                for b in range(3):
                    damped[a, b] = hessian[a, b]
                damped[a, a] += damping * hessian[a, a] + 1e-12
            if not solve3(damped, gradient, step):
                break
            for a in range(3):
                trial[a] = pose[a] - step[a]
            trial_value = objective(grid, half, points, trial, scale, prior_mean, prior_information,
                                    widening, 0.0, trial_out, trial_gradient, trial_hessian)  # fmt: skip
            evaluations += 1
            length = max(abs(step[0]), abs(step[1]), abs(step[2]))
            if trial_value <= value:
                pose[:], value, out[:] = trial, trial_value, trial_out
                gradient[:], hessian[:, :] = trial_gradient, trial_hessian
                damping = max(damping * 0.1, LEAST_DAMPING)
            else:
                damping *= 10.0
            if length < tolerance:
                converged = True
                break
            if damping > GREATEST_DAMPING:
                break
    return value, out[0], iterations, evaluations, converged
