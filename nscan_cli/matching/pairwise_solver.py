"""The minimum of the energy of one scan against one NDT: damped Newton steps (paper, III-C, III-F).

Each stage widens the Gaussians less than the one before. Steps use the semi-definite part of the Hessian,
since the exact one need not be positive far from the optimum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.damped_newton import PAIRWISE_STEPS, is_accepted, is_last, next_damping
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.small_matrices import solve_definite
from nscan_cli.ndt.association import Association, update_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS, sum_association, unpack_derivatives
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array


class PairProblem(NamedTuple):
    """The objective: scale · E(u) + ½ (u − z)ᵗ P (u − z)."""

    grid: Grid
    half: float
    """Side (m) of a lattice cell."""
    association: Association
    """That of the points (m, 2) at the last pose."""
    scale: float
    """Factor that makes a negative log likelihood of E."""
    prior: Prior
    """(14), with mean z and information P."""


@leaf_kernel
def pairwise_objective(
    problem: PairProblem,
    pose: Array,
    widening: float,
    curvature: float,
    out: Array,
    gradient: Array,
    hessian: Array,
) -> float:
    """The objective at `pose`, to which the association moves.

    Writes the gradient (3,) and Hessian (3, 3) of the objective, and those of E into out (10,).
    """
    association = problem.association
    update_association(problem.grid, problem.half, association, pose)
    sum_association(association, widening, curvature, out)
    unpack_derivatives(out, problem.scale, gradient, hessian)
    value = problem.scale * out[0]
    mean, information = problem.prior
    turn = pose[2] - mean[2]
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    for a in range(3):
        pull = 0.0
        for b in range(3):
            difference = turn if b == 2 else pose[b] - mean[b]
            pull += information[a, b] * difference
            hessian[a, b] += information[a, b]
        gradient[a] += pull
        value += 0.5 * pull * (turn if a == 2 else pose[a] - mean[a])
    return float(value)


@kernel
def minimise_pairwise(
    problem: PairProblem,
    pose: Array,
    widenings: Array,
    max_iterations: int,
    near: float,
    tolerance: float,
    hessian: Array,
) -> tuple[float, float, int, int, bool]:
    """Levenberg–Marquardt from `pose` (3,), in place, one stage for each entry of `widenings`.

    The last stage ends with a step that moves the pose by less than `tolerance` (m, rad), the others with one
    of less than `near`. Writes the last stage's semi-definite Hessian of the objective (3, 3). Returns the
    values of the objective and of E, iterations, evaluations, and whether the last stage converged. Hessian
    and values are those before the last step.
    """
    out, trial_out = np.empty(ENERGY_NUMBERS), np.empty(ENERGY_NUMBERS)
    gradient, step, trial = np.empty(3), np.empty(3), np.empty(3)
    trial_gradient, trial_hessian, damped = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    value, iterations, evaluations, converged = 0.0, 0, 0, False
    for stage in range(widenings.shape[0]):
        widening, enough = widenings[stage], near if stage + 1 < widenings.shape[0] else tolerance
        value = pairwise_objective(problem, pose, widening, 0.0, out, gradient, hessian)
        evaluations += 1
        damping, converged = PAIRWISE_STEPS.first, False
        for _ in range(max_iterations):
            iterations += 1
            assign_rows(damped, hessian)
            for a in range(3):
                damped[a, a] += damping * hessian[a, a] + 1e-12
            if not solve_definite(damped, gradient, step):
                break
            for a in range(3):
                trial[a] = pose[a] - step[a]
            length = max(abs(step[0]), abs(step[1]), abs(step[2]))
            converged = is_last(length, enough, damping, PAIRWISE_STEPS)
            if converged and damping <= PAIRWISE_STEPS.trusted:
                # Value and Hessian would hardly change.
                assign(pose, trial)
                break
            trial_value = pairwise_objective(
                problem, trial, widening, 0.0, trial_out, trial_gradient, trial_hessian
            )
            evaluations += 1
            accepted = is_accepted(value, trial_value, PAIRWISE_STEPS)
            if accepted:
                value = trial_value
                assign(pose, trial)
                assign(out, trial_out)
                assign(gradient, trial_gradient)
                assign_rows(hessian, trial_hessian)
            damping = next_damping(damping, accepted, PAIRWISE_STEPS)
            if converged or damping > PAIRWISE_STEPS.greatest:
                break
    return value, out[0], iterations, evaluations, converged
