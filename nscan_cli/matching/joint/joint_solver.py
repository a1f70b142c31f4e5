"""The minimum of the joint energy: damped Newton steps, stage by stage (paper, III)."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.damped_newton import JOINT_STEPS, is_accepted, is_last, next_damping, next_stretch
from nscan_cli.matching.joint.gauge import gauge_fixed_step
from nscan_cli.matching.joint.joint_energy import JointProblem, evaluate_joint
from nscan_cli.matching.joint.options import DescentSettings
from nscan_cli.poses import Array


@kernel
def descend(
    problem: JointProblem,
    poses: Array,
    stages: Array,
    exact: bool,
    neutral: bool,
    settings: DescentSettings,
    gradient: Array,
    hessian: Array,
) -> tuple[float, int, int, int]:
    """Descend from the poses (n, 3), in place, in `stages` (k, 2): the widening of each, and its tolerance.

    Writes gradient (3n,) and Hessian (3n, 3n) of the last stage. Returns its value of the objective, and the
    numbers of iterations, of evaluations, and of stages that did not converge.
    """
    value, iterations, evaluations, unsettled = np.inf, 0, 0, 0
    for k in range(len(stages)):
        value, steps, evaluated, converged = _stage(
            problem, poses, stages[k, 0], stages[k, 1], exact, neutral, settings, gradient, hessian
        )
        iterations += steps
        evaluations += evaluated
        unsettled += not converged
    return value, iterations, evaluations, unsettled


@kernel
def _stage(
    problem: JointProblem,
    poses: Array,
    widening: float,
    tolerance: float,
    exact: bool,
    neutral: bool,
    settings: DescentSettings,
    gradient: Array,
    hessian: Array,
) -> tuple[float, int, int, bool]:
    """One stage. Returns the value of the objective, the numbers of iterations and of evaluations, and
    whether it converged: no pose moved by more than `tolerance` (m and rad)."""
    fixed, stride = settings.fixed, settings.stride
    trial_gradient, trial_hessian = np.empty_like(gradient), np.empty_like(hessian)
    step, trial = np.empty_like(poses), np.empty_like(poses)
    curvature = 1.0 if exact else 0.0
    value = evaluate_joint(problem, poses, widening, curvature, neutral, stride, gradient, hessian)
    iterations, evaluations, damping, stretch, converged = 0, 1, JOINT_STEPS.first, 1.0, False
    for _ in range(settings.iterations):
        solved = gauge_fixed_step(gradient, hessian, poses, damping, fixed, step)
        factor = 1.0 if exact and solved else stretch
        if not solved and exact:
            # The exact Hessian is not positive definite here.
            evaluate_joint(problem, poses, widening, 0.0, neutral, stride, trial_gradient, trial_hessian)
            evaluations += 1
            solved = gauge_fixed_step(gradient, trial_hessian, poses, damping, fixed, step)
        if not solved:
            damping = next_damping(damping, False, JOINT_STEPS)
            continue
        iterations += 1
        longest = slope = 0.0
        for i in range(poses.shape[0]):
            for a in range(3):
                slope -= gradient[3 * i + a] * step[i, a]
                moved = factor * step[i, a]
                trial[i, a] = poses[i, a] + moved
                longest = max(longest, abs(moved))
        converged = is_last(longest, tolerance, damping, JOINT_STEPS)
        if converged and not settings.thorough:
            assign_rows(poses, trial)
            break
        there = evaluate_joint(
            problem, trial, widening, curvature, neutral, stride, trial_gradient, trial_hessian
        )
        evaluations += 1
        gain, accepted = value - there, is_accepted(value, there, JOINT_STEPS)
        if accepted:
            value = there
            assign_rows(poses, trial)
            assign(gradient, trial_gradient)
            assign_rows(hessian, trial_hessian)
        if accepted or factor == 1.0:
            damping = next_damping(damping, accepted, JOINT_STEPS)
        if settings.stretched and iterations > JOINT_STEPS.unstretched:
            stretch = next_stretch(slope, factor, gain, JOINT_STEPS)
        if converged or damping > JOINT_STEPS.greatest:
            break
    return value, iterations, evaluations, converged
