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
from nscan_cli.matching.motion_model import Prior, prior_pull
from nscan_cli.matching.small_matrices import solve_definite
from nscan_cli.ndt.association import Association, update_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS, sum_association, unpack_derivatives
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array


class PairProblem(NamedTuple):
    """The objective of a pairwise match: scale · E(u) + ½ (u − z)ᵗ P (u − z)."""

    grid: Grid
    half: float
    """Side (m) of a lattice cell."""
    association: Association
    """The points (m, 2) of the scan at the last pose, with their Gaussians."""
    scale: float
    """Factor that makes a negative log likelihood of E."""
    prior: Prior
    """Eq. (14), with mean z and information P."""


class PairDescent(NamedTuple):
    """What the minimisation of a pairwise objective has led to, and what it took."""

    value: float
    """The objective before the last step."""
    energy: float
    """E before the last step."""
    iterations: int
    """Number in all stages."""
    last_iterations: int
    """Number in the last stage."""
    evaluations: int
    """Number of evaluations of the objective in all stages."""
    unsettled: int
    """Number of stages before the last that did not converge."""
    converged: bool
    """Whether the last stage converged."""


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
    """The objective at `pose` (3,), to which the association moves.

    Writes the gradient (3,) and Hessian (3, 3) of the objective, and those of E into out (10,). With a
    `curvature` of 1 the Hessian is exact, with 0 it is the semi-definite part.
    """
    association = problem.association
    update_association(problem.grid, problem.half, association, pose)
    sum_association(association, widening, curvature, out)
    unpack_derivatives(out, problem.scale, gradient, hessian)
    value = problem.scale * out[0]
    off, pull = prior_pull(problem.prior, pose)
    for a in range(3):
        for b in range(3):
            hessian[a, b] += problem.prior.information[a, b]
        gradient[a] += pull[a]
        value += 0.5 * pull[a] * off[a]
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
) -> PairDescent:
    """Minimise from `pose` (3,), in place, after Levenberg and Marquardt: a stage for each of `widenings`.

    The last stage ends with a step that moves the pose by less than `tolerance` (m, rad), the others with one
    of less than `near`. Writes the semi-definite Hessian (3, 3) of the objective before the last step.
    """
    out, trial_out = np.empty(ENERGY_NUMBERS), np.empty(ENERGY_NUMBERS)
    gradient, step, trial = np.empty(3), np.empty(3), np.empty(3)
    trial_gradient, trial_hessian, damped = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    value, iterations, last, evaluations, unsettled, converged = 0.0, 0, 0, 0, 0, True
    for stage in range(widenings.shape[0]):
        widening, enough = widenings[stage], near if stage + 1 < widenings.shape[0] else tolerance
        unsettled += not converged
        value = pairwise_objective(problem, pose, widening, 0.0, out, gradient, hessian)
        evaluations += 1
        damping, converged, last = PAIRWISE_STEPS.first, False, 0
        for _ in range(max_iterations):
            last += 1
            assign_rows(damped, hessian)
            for a in range(3):
                damped[a, a] += damping * hessian[a, a] + PAIRWISE_STEPS.floor
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
        iterations += last
    return PairDescent(value, out[0], iterations, last, evaluations, unsettled, converged)
