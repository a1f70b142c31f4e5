"""Minimise the energy of one scan against one NDT: damped Newton steps in stages (paper, III-C, III-F).

The stages widen the Gaussians less and less; far from the optimum the steps use the semi-definite part of
the Hessian, because the exact one need not be positive there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.assign import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.damped_newton import PAIRWISE, is_accepted, is_last, next_damping
from nscan_cli.matching.priors import Prior
from nscan_cli.matching.small_matrices import solve_definite
from nscan_cli.ndt.association import Association, associate_again
from nscan_cli.ndt.energy import OUT, sum_meeting, unpack
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array


class PairProblem(NamedTuple):
    """What is minimised: scale · E(u) + ½ (u − z)ᵗ P (u − z)."""

    grid: Grid
    half: float
    """Side (m) of a lattice cell."""
    meeting: Association
    """Of the points (m, 2); it moves with the pose."""
    scale: float
    """What E is multiplied with to be a negative log likelihood."""
    prior: Prior
    """(14), of mean z and information P."""


@leaf_kernel
def objective(
    problem: PairProblem,
    pose: Array,
    widening: float,
    curvature: float,
    out: Array,
    gradient: Array,
    hessian: Array,
) -> float:
    """The objective at `pose`, to which the meeting of the points moves; writes its gradient (3,) and Hessian
    (3, 3), and E's own into out (10,)."""
    meeting = problem.meeting
    associate_again(problem.grid, problem.half, meeting, pose[0], pose[1], pose[2])
    sum_meeting(meeting, widening, curvature, out)
    unpack(out, problem.scale, gradient, hessian)
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
def minimise(
    problem: PairProblem,
    pose: Array,
    widenings: Array,
    max_iterations: int,
    near: float,
    tolerance: float,
    hessian: Array,
) -> tuple[float, float, int, int, bool]:
    """Levenberg–Marquardt from `pose` (3,), in place, one stage for each entry of `widenings`.

    The last stage ends with a step that moves the pose by less than `tolerance` (m, rad), those before with
    one of less than `near`: they only have to lead there. Writes the last stage's semi-definite Hessian of
    the objective (3, 3). Returns the objective's and E's value, iterations, evaluations, and whether the last
    stage converged. Hessian and values are those before that last step.
    """
    out, trial_out = np.empty(OUT), np.empty(OUT)
    gradient, step, trial = np.empty(3), np.empty(3), np.empty(3)
    trial_gradient, trial_hessian, damped = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    value, iterations, evaluations, converged = 0.0, 0, 0, False
    for stage in range(widenings.shape[0]):
        widening, enough = widenings[stage], near if stage + 1 < widenings.shape[0] else tolerance
        value = objective(problem, pose, widening, 0.0, out, gradient, hessian)
        evaluations += 1
        damping, converged = PAIRWISE.first, False
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
            converged = is_last(length, enough, damping, PAIRWISE)
            if converged and damping <= PAIRWISE.trusted:
                # So near that the value and the Hessian are known well enough.
                assign(pose, trial)
                break
            trial_value = objective(problem, trial, widening, 0.0, trial_out, trial_gradient, trial_hessian)
            evaluations += 1
            accepted = is_accepted(value, trial_value, PAIRWISE)
            if accepted:
                value = trial_value
                assign(pose, trial)
                assign(out, trial_out)
                assign(gradient, trial_gradient)
                assign_rows(hessian, trial_hessian)
            damping = next_damping(damping, accepted, PAIRWISE)
            if converged or damping > PAIRWISE.greatest:
                break
    return value, out[0], iterations, evaluations, converged
