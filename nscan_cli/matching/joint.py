"""nScan-Matching: find the poses of n scans that minimise their joint energy (paper, III)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.compiled import kernel
from nscan_cli.matching.joint_energy import JointProblem, evaluate, joint_energy
from nscan_cli.matching.linear import solve_definite
from nscan_cli.poses import Array, wrap

FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-8
GREATEST_DAMPING = 1e4
FREE = -1
"""In place of a fixed scan: the gauge is free."""


@dataclass(frozen=True)
class JointOptions:
    """How a joint match is minimised."""

    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """One stage each: w of the energy; 1 is the energy itself."""
    max_iterations: int = 30
    """In each stage."""
    tolerance: float = 1e-4
    """A stage has converged when no pose moves by more (m, rad)."""
    fixed: int | None = None
    """The scan that stays where it is; None leaves the gauge free (paper, III-D)."""
    neutral: bool = False
    """Whether steps are judged by the neutral energy, see joint_energy."""


@dataclass(frozen=True)
class JointMatch:
    """The result of nScan matching: local poses and the Hessian there."""

    poses: Array
    """(n, 3)"""
    hessian: Array
    """(3n, 3n) exact Hessian of the objective at the poses, the gauge still in it."""
    energy: float
    gradient_norm: float
    iterations: int
    evaluations: int
    converged: bool


def match_jointly(problem: JointProblem, start: Array, options: JointOptions) -> JointMatch:
    """Minimise the joint energy from the poses `start` (n, 3), stage by stage.

    The steps are Newton's, eq. (5) to (8), damped as by Levenberg and Marquardt; with the semi-definite
    part of the Hessian in the early stages, and in the last where the exact one is not positive definite.
    """
    poses = start.copy()
    fixed = FREE if options.fixed is None else options.fixed
    iterations = evaluations = 0
    converged = False
    for stage, widening in enumerate(options.widenings):
        exact = stage == len(options.widenings) - 1
        steps, evaluated, converged = _descend(
            problem, poses, widening, exact, options.neutral, fixed, options.max_iterations, options.tolerance
        )
        iterations += steps
        evaluations += evaluated
    final = joint_energy(problem, poses)
    poses[:, 2] = wrap(poses[:, 2])
    return JointMatch(
        poses,
        final.hessian,
        final.value,
        float(np.linalg.norm(final.gradient)),
        iterations,
        evaluations + 1,
        converged,
    )


def match_near_and_far(problem: JointProblem, start: Array, options: JointOptions) -> JointMatch:
    """Match twice from `start` (n, 3), and keep the result of the lower neutral energy.

    Through all stages a far optimum is found; but the reward for overlap slides scans together where a
    corridor leaves them room. By the last stage alone, judged by the neutral energy, they stay apart;
    but only a near optimum is found. Iterations and evaluations are those of both.
    """
    near = replace(options, widenings=options.widenings[-1:], neutral=True)
    matches = [match_jointly(problem, start, each) for each in (options, near)]
    values = [joint_energy(problem, match.poses, neutral=True).value for match in matches]
    best = matches[int(np.argmin(values))]
    return replace(
        best,
        iterations=sum(match.iterations for match in matches),
        evaluations=sum(match.evaluations for match in matches) + len(matches),
    )


@kernel
def _descend(
    problem: JointProblem,
    poses: Array,
    widening: float,
    exact: bool,
    neutral: bool,
    fixed: int,
    max_iterations: int,
    tolerance: float,
) -> tuple[int, int, bool]:
    """One stage, from the poses (n, 3) in place: its iterations, evaluations, and whether it converged."""
    n = poses.shape[0]
    gradient, trial_gradient = np.empty(3 * n), np.empty(3 * n)
    hessian, trial_hessian = np.empty((3 * n, 3 * n)), np.empty((3 * n, 3 * n))
    step = np.empty((n, 3))
    curvature = 1.0 if exact else 0.0
    value = evaluate(problem, poses, widening, curvature, neutral, gradient, hessian)
    iterations, evaluations, damping = 0, 1, FIRST_DAMPING
    for _ in range(max_iterations):
        solved = newton_step(gradient, hessian, poses, damping, fixed, step)
        if not solved and exact:
            # Not positive definite: go on with the part that is.
            evaluate(problem, poses, widening, 0.0, neutral, gradient, hessian)
            evaluations += 1
            solved = newton_step(gradient, hessian, poses, damping, fixed, step)
        if not solved:
            damping *= 10
            continue
        iterations += 1
        trial = poses + step
        there = evaluate(problem, trial, widening, curvature, neutral, trial_gradient, trial_hessian)
        evaluations += 1
        if there <= value:
            poses[:, :] = trial
            value = there
            gradient, trial_gradient = trial_gradient, gradient
            hessian, trial_hessian = trial_hessian, hessian
            damping = max(0.1 * damping, LEAST_DAMPING)
        else:
            damping *= 10
        if np.abs(step).max() < tolerance:
            return iterations, evaluations, True
        if damping > GREATEST_DAMPING:
            break
    return iterations, evaluations, False


@kernel
def newton_step(
    gradient: Array, hessian: Array, poses: Array, damping: float, fixed: int, step: Array
) -> bool:
    """Write the step (n, 3) that solves (H + damping · diag H) Δp = −g in the chosen gauge (paper, III-D).

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
