"""Minimisation of a graph's energy by sparse damped Newton steps (paper, IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import factorise, solve
from nscan_cli.graph.linalg.factor_pattern import Pattern
from nscan_cli.graph.optimise.graph_energy import GraphEnergy, System
from nscan_cli.matching.damped_newton import GRAPH_STEPS, is_accepted, is_last, next_damping
from nscan_cli.poses import Array, wrap


@dataclass(frozen=True)
class StopOptions:
    """When an optimisation ends, and which Hessian its steps use."""

    max_iterations: int = 100
    """Most iterations. A larger number is slower where they do not converge."""
    tolerance: float = 1e-6
    """The optimisation ends with a step below this, m and rad. A larger one ends it earlier."""
    exact_hessian_step: float = 0.1
    """The exact Hessian is used after a shorter step, m and rad. Near the minimum it takes fewer steps than
    the Gauss–Newton part. With a larger value it is used farther away, where it takes more, and often is not
    positive definite."""
    negligible_gain: float = 1e-7
    """Where relations leave a direction undetermined, a step that decreases 1 + energy by a smaller share is
    the last: it moves less than a thousandth of a standard deviation. A larger share ends earlier."""


@dataclass(frozen=True)
class Optimum:
    """The result of a minimisation."""

    poses: Array
    """(K, 3)"""
    energy: float
    """The energy at the poses, Σ fᵗHf."""
    iterations: int
    converged: bool
    """Whether the last step was within the tolerance without being damped."""


def optimise_poses(energy: GraphEnergy, poses: Array, stop: StopOptions = StopOptions()) -> Optimum:
    """Minimise from the poses (K, 3) until a step moves no pose by more than `stop.tolerance` (m, rad).

    Newton steps use the Gauss–Newton part of the Hessian while they are long, and the exact Hessian (25) once
    they are short and it is positive definite. They are damped, after Levenberg and Marquardt, where they
    would raise the energy or the relations leave a direction undetermined. In such a direction the poses
    could move without end, so the minimisation stops where a step gains a negligible amount.
    """
    here, exact, damping, is_open = energy.evaluate(poses, exact=False), False, GRAPH_STEPS.first, False
    iteration = 0
    for iteration in range(1, stop.max_iterations + 1):
        step = newton_step(energy.pattern, here, damping)
        if step is None and exact:
            here, exact = energy.evaluate(poses, exact=False), False
            step = newton_step(energy.pattern, here, damping)
        if not damping:
            is_open = step is None
        accepted = False
        if step is not None:
            trial = poses.copy()
            trial[energy.free] += step
            length = float(np.abs(step).max(initial=0.0))
            if is_last(length, stop.tolerance, damping, GRAPH_STEPS):
                value = float(energy.terms(trial).sum())
                if is_accepted(here.value, value, GRAPH_STEPS):
                    return Optimum(_wrapped(trial), value, iteration, True)
                return Optimum(_wrapped(poses), here.value, iteration, True)
            is_short = length < stop.exact_hessian_step
            there = energy.evaluate(trial, is_short)
            accepted = is_accepted(here.value, there.value, GRAPH_STEPS)
            if accepted:
                gains = here.value - there.value > stop.negligible_gain * (1 + here.value)
                if is_open and damping <= GRAPH_STEPS.least_raised and not gains:
                    return Optimum(_wrapped(trial), there.value, iteration, True)
                poses, here, exact = trial, there, is_short
        damping = next_damping(damping, accepted, GRAPH_STEPS)
        if damping > GRAPH_STEPS.greatest:
            break
    return Optimum(_wrapped(poses), here.value, iteration, False)


def newton_step(pattern: Pattern, system: System, damping: float = 0.0) -> Array | None:
    """The step (F, 3) of the free poses; None where the damped Hessian is not positive definite."""
    matrix = system.hessian
    if damping:
        matrix = matrix.copy()
        block, component = pattern.starts[:-1, None], np.arange(3)
        diagonal = matrix[block, component, component]
        # The second term is for directions without information; it is damped, too.
        floor = GRAPH_STEPS.floor_share * diagonal.max(initial=0.0)
        matrix[block, component, component] += damping * (diagonal + floor)
    factor = factorise(pattern, matrix)
    return None if factor.loose.any() else -solve(factor, system.gradient)


def _wrapped(poses: Array) -> Array:
    poses = poses.copy()
    poses[:, 2] = wrap(poses[:, 2])
    return poses
