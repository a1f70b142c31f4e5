"""nScan-Matching in compiled code: damped Newton steps on the joint energy, stage by stage (paper, III)."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.assign import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.damped_newton import JOINT, is_accepted, is_last, next_damping
from nscan_cli.matching.joint.gauge import gauge_fixed_step
from nscan_cli.matching.joint.joint_energy import JointProblem, evaluate
from nscan_cli.poses import Array


@kernel
def approach_and_finish(
    problem: JointProblem,
    poses: Array,
    widenings: Array,
    neutral: bool,
    of_approach: tuple[int, int, int, float, bool],
    max_iterations: int,
    tolerance: float,
    gradient: Array,
    hessian: Array,
) -> tuple[float, int, bool, int, int, int]:
    """All stages, from the poses (n, 3) in place, those of the approach and the last one.

    Returns the value, the last stage's iterations, whether it converged, and what `approach` does, of all.
    Writes gradient (3n,) and Hessian (3n, 3n) at the poses; other arguments as in JointOptions.
    """
    stride, fixed, approach_iterations, near, thorough = of_approach
    iterations, evaluations, unsettled = approach(
        problem, poses, widenings, neutral, stride, fixed, approach_iterations, near, thorough
    )
    value, last, evaluated, converged = descend(
        problem, poses, 1.0, True, neutral, 1, fixed, max_iterations, tolerance, thorough, gradient, hessian
    )
    return value, last, converged, iterations + last, evaluations + evaluated, unsettled


@kernel
def approach(
    problem: JointProblem,
    poses: Array,
    widenings: Array,
    neutral: bool,
    stride: int,
    fixed: int,
    max_iterations: int,
    near: float,
    thorough: bool,
) -> tuple[int, int, int]:
    """An approach, from the poses (n, 3) in place: iterations, evaluations, stages that did not settle."""
    n = poses.shape[0]
    gradient, hessian = np.empty(3 * n), np.empty((3 * n, 3 * n))
    iterations = evaluations = unsettled = 0
    for widening in widenings:
        enough = near if widening < 1.0 else 0.5 * near
        _, steps, evaluated, settled = descend(
            problem,
            poses,
            widening,
            False,
            neutral,
            stride,
            fixed,
            max_iterations,
            enough,
            thorough,
            gradient,
            hessian,
        )
        iterations += steps
        evaluations += evaluated
        unsettled += not settled
    return iterations, evaluations, unsettled


@kernel
def descend(
    problem: JointProblem,
    poses: Array,
    widening: float,
    exact: bool,
    neutral: bool,
    stride: int,
    fixed: int,
    max_iterations: int,
    tolerance: float,
    thorough: bool,
    gradient: Array,
    hessian: Array,
) -> tuple[float, int, int, bool]:
    """One stage, from the poses (n, 3) in place: the value, iterations, evaluations, whether it converged.

    Writes gradient (3n,) and Hessian (3n, 3n) at the poses; `thorough` as in JointOptions.
    """
    trial_gradient, trial_hessian = np.empty_like(gradient), np.empty_like(hessian)
    step, trial = np.empty_like(poses), np.empty_like(poses)
    curvature = 1.0 if exact else 0.0
    value = evaluate(problem, poses, widening, curvature, neutral, stride, gradient, hessian)
    iterations, evaluations, damping, converged = 0, 1, JOINT.first, False
    for _ in range(max_iterations):
        solved = gauge_fixed_step(gradient, hessian, poses, damping, fixed, step)
        if not solved and exact:
            # Not positive definite: go on with the part that is.
            evaluate(problem, poses, widening, 0.0, neutral, stride, trial_gradient, trial_hessian)
            evaluations += 1
            solved = gauge_fixed_step(gradient, trial_hessian, poses, damping, fixed, step)
        if not solved:
            damping = next_damping(damping, False, JOINT)
            continue
        iterations += 1
        longest = 0.0
        for i in range(poses.shape[0]):
            for a in range(3):
                trial[i, a] = poses[i, a] + step[i, a]
                longest = max(longest, abs(step[i, a]))
        converged = is_last(longest, tolerance, damping, JOINT)
        if converged and not thorough:
            assign_rows(poses, trial)
            break
        there = evaluate(problem, trial, widening, curvature, neutral, stride, trial_gradient, trial_hessian)
        evaluations += 1
        accepted = is_accepted(value, there, JOINT)
        if accepted:
            value = there
            assign_rows(poses, trial)
            assign(gradient, trial_gradient)
            assign_rows(hessian, trial_hessian)
        damping = next_damping(damping, accepted, JOINT)
        if converged or damping > JOINT.greatest:
            break
    return value, iterations, evaluations, converged
