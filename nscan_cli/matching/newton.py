"""Minimise the energy of one scan against one NDT: damped Newton steps in stages (paper, III-C, III-F).

The stages widen the Gaussians less and less; far from the optimum the steps use the semi-definite part of
the Hessian, because the exact one need not be positive there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.assign import assign, assign_rows
from nscan_cli.compiled import kernel, lean_kernel
from nscan_cli.matching.linear import solve_definite
from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.energy import OUT, sum_meeting, unpack
from nscan_cli.ndt.meeting import Meeting, meet_again
from nscan_cli.ndt.table import Grid
from nscan_cli.poses import Array

FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-7
GREATEST_DAMPING = 1e6
STALLED = 0.1
"""Share of the tolerance below which a damped step ends a stage."""
DAMPED = 1e-2
"""After a step that is refused there is at least so much damping: less changes the next one hardly."""
SETTLED = 0.02
"""Standard deviations; a shorter step ends the last stage,"""
NEARLY = 0.3
"""and a stage before it one that is shorter than this and"""
NEAR = 1e-3
"""m, rad."""
JUMP = 0.3
"""Standard deviations; a shorter step that is refused ends a stage. The energy jumps where a point gets into
another cell, by more than such a step can win: what is refused there is refused again and again."""


class PairProblem(NamedTuple):
    """What is minimised: scale · E(u) + ½ (u − z)ᵗ P (u − z)."""

    grid: Grid
    half: float
    """Side (m) of a lattice cell."""
    meeting: Meeting
    """Of the points (m, 2); it moves with the pose."""
    scale: float
    """What E is multiplied with to be a negative log likelihood."""
    prior: Prior
    """(14), of mean z and information P."""


@lean_kernel
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
    meet_again(problem.grid, problem.half, meeting, pose[0], pose[1], pose[2])
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
    tolerance: float,
    thorough: bool,
    hessian: Array,
) -> tuple[float, float, int, int, bool]:
    """Levenberg–Marquardt from `pose` (3,), in place, one stage for each entry of `widenings`.

    A stage ends with a step that moves the pose by less than `tolerance` (m, rad). Unless it shall be
    `thorough`, it also ends with one that is short as against what the scan tells: a fifth of the evaluations
    lead as near to the truth. Writes the last stage's semi-definite Hessian of the objective (3, 3). Returns
    the objective's and E's value, iterations, evaluations, and whether the last stage converged. Hessian and
    values are those before that last step.
    """
    out, trial_out = np.empty(OUT), np.empty(OUT)
    gradient, step, trial = np.empty(3), np.empty(3), np.empty(3)
    trial_gradient, trial_hessian, damped = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    jump, damped_least = (0.0, 0.0) if thorough else (JUMP, DAMPED)
    value, iterations, evaluations, converged = 0.0, 0, 0, False
    for stage in range(widenings.shape[0]):
        widening, settled, near = widenings[stage], 0.0, 0.0
        if not thorough:
            settled, near = (NEARLY, NEAR) if stage < widenings.shape[0] - 1 else (SETTLED, np.inf)
        value = objective(problem, pose, widening, 0.0, out, gradient, hessian)
        evaluations += 1
        damping = FIRST_DAMPING
        converged = False
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
            # In standard deviations; half its square is what the step is expected to win.
            squared = gradient[0] * step[0] + gradient[1] * step[1] + gradient[2] * step[2]
            is_short = length < tolerance or (length < near and squared < settled**2)
            if is_short and damping <= FIRST_DAMPING:
                # So near that the value and the Hessian are known well enough.
                assign(pose, trial)
                converged = True
                break
            trial_value = objective(problem, trial, widening, 0.0, trial_out, trial_gradient, trial_hessian)
            evaluations += 1
            # A step that is short because it is damped says less.
            converged = length < STALLED * tolerance
            if trial_value <= value:
                value = trial_value
                assign(pose, trial)
                assign(out, trial_out)
                assign(gradient, trial_gradient)
                assign_rows(hessian, trial_hessian)
                damping = max(damping * 0.1, LEAST_DAMPING)
            else:
                damping = max(damping * 10.0, damped_least)
                converged = converged or squared < jump**2
            if converged or damping > GREATEST_DAMPING:
                break
    return value, out[0], iterations, evaluations, converged
