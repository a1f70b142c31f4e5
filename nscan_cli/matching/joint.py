"""nScan-Matching: find the poses of n scans that minimise their joint energy (paper, III)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from nscan_cli.matching.joint_energy import JointEnergy, Priors, Scans, joint_energy
from nscan_cli.poses import Array, wrap

FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-8
GREATEST_DAMPING = 1e4


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


def match_jointly(
    scans: Scans,
    pairs: NDArray[np.int64],
    priors: Priors,
    start: Array,
    scale: float,
    options: JointOptions,
) -> JointMatch:
    """Minimise scale · E(p) plus priors from the poses `start` (n, 3), stage by stage.

    The steps are Newton's, eq. (5) to (8), damped as by Levenberg and Marquardt; with the semi-definite
    part of the Hessian in the early stages, and in the last where the exact one is not positive definite.
    """
    poses = start.copy()
    iterations = evaluations = 0
    converged = False
    for stage, widening in enumerate(options.widenings):
        exact = stage == len(options.widenings) - 1
        here = joint_energy(scans, pairs, priors, poses, scale, widening, exact, options.neutral)
        evaluations += 1
        damping, converged = FIRST_DAMPING, False
        for _ in range(options.max_iterations):
            step = newton_step(here, poses, damping, options.fixed)
            if step is None:
                if exact:
                    # Not positive definite: go on with the part that is.
                    here = joint_energy(scans, pairs, priors, poses, scale, widening, False, options.neutral)
                    evaluations += 1
                    step = newton_step(here, poses, damping, options.fixed)
                if step is None:
                    damping *= 10
                    continue
            iterations += 1
            trial = poses + step
            there = joint_energy(scans, pairs, priors, trial, scale, widening, exact, options.neutral)
            evaluations += 1
            if there.value <= here.value:
                poses, here = trial, there
                damping = max(0.1 * damping, LEAST_DAMPING)
            else:
                damping *= 10
            if np.abs(step).max() < options.tolerance:
                converged = True
                break
            if damping > GREATEST_DAMPING:
                break
    final = joint_energy(scans, pairs, priors, poses, scale)
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


def match_near_and_far(
    scans: Scans,
    pairs: NDArray[np.int64],
    priors: Priors,
    start: Array,
    scale: float,
    options: JointOptions,
) -> JointMatch:
    """Match twice from `start` (n, 3), and keep the result of the lower neutral energy.

    Through all stages a far optimum is found; but the reward for overlap slides scans together where a
    corridor leaves them room. By the last stage alone, judged by the neutral energy, they stay apart;
    but only a near optimum is found. Iterations and evaluations are those of both.
    """
    near = replace(options, widenings=options.widenings[-1:], neutral=True)
    matches = [match_jointly(scans, pairs, priors, start, scale, each) for each in (options, near)]
    values = [joint_energy(scans, pairs, priors, match.poses, scale, neutral=True).value for match in matches]
    best = matches[int(np.argmin(values))]
    return replace(
        best,
        iterations=sum(match.iterations for match in matches),
        evaluations=sum(match.evaluations for match in matches) + len(matches),
    )


def newton_step(energy: JointEnergy, poses: Array, damping: float, fixed: int | None) -> Array | None:
    """The step (n, 3) that solves (H + damping · diag H) Δp = −g in the chosen gauge (paper, III-D).

    With `fixed` None the step is the smallest one: without any part along the three null directions.
    None when the matrix is not positive definite.
    """
    n = len(poses)
    diagonal = np.abs(np.diag(energy.hessian))
    matrix = energy.hessian + np.diag(damping * diagonal + 1e-9 * diagonal.max() + 1e-12)
    if fixed is None:
        null = gauge_directions(poses)
        matrix += diagonal.max() * (null @ null.T)
        keep = np.arange(3 * n)
    else:
        keep = np.delete(np.arange(3 * n), [3 * fixed, 3 * fixed + 1, 3 * fixed + 2])
        matrix = matrix[np.ix_(keep, keep)]
    try:
        factor = cho_factor(matrix, check_finite=False)
    except np.linalg.LinAlgError:
        return None
    step = np.zeros(3 * n)
    step[keep] = -cho_solve(factor, energy.gradient[keep], check_finite=False)
    return step.reshape(n, 3)


def gauge_directions(poses: Array) -> Array:
    """An orthonormal basis (3n, 3) of the global motions that leave the energy as it is."""
    n = len(poses)
    directions = np.zeros((n, 3, 3))
    directions[:, 0, 0] = directions[:, 1, 1] = directions[:, 2, 2] = 1.0
    centred = poses[:, :2] - poses[:, :2].mean(axis=0)
    directions[:, 0, 2], directions[:, 1, 2] = -centred[:, 1], centred[:, 0]
    return np.linalg.qr(directions.reshape(3 * n, 3))[0]
