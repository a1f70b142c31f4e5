"""The poses that minimise the energy of a graph: sparse damped Newton steps (paper, IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import factorise, solve
from nscan_cli.graph.linalg.factor_pattern import Pattern
from nscan_cli.graph.optimise.graph_energy import GraphEnergy, System
from nscan_cli.matching.damped_newton import GRAPH_STEPS, is_accepted, is_last, next_damping
from nscan_cli.poses import Array, wrap

EXACT_HESSIAN_STEP = 0.1
"""m, rad: the exact Hessian is used once a step is shorter. It needs fewer steps there than the
Gauss–Newton part; farther away it needs more, and often is not positive definite."""
NEGLIGIBLE_GAIN = 1e-7
"""Of the energy, or of a χ² of 1: where relations leave a direction open, a step that gains less is the
last: it moves less than a thousandth of a standard deviation."""


@dataclass(frozen=True)
class Optimum:
    """Poses (K, 3) at a minimum, the energy there, and how it was reached."""

    poses: Array
    energy: float
    iterations: int
    converged: bool
    """Whether the last step was within the tolerance, and not because it was damped."""


def optimise(
    energy: GraphEnergy, poses: Array, max_iterations: int = 100, tolerance: float = 1e-6
) -> Optimum:
    """Minimise from the poses (K, 3) until a step moves no pose by more than `tolerance` (m, rad).

    The steps are Newton's with the Gauss–Newton part of the Hessian while the poses move far, with the
    exact Hessian (25) when they settle and it is positive definite. They are damped, after Levenberg and
    Marquardt, when they would raise the energy or the relations leave a direction open. In such a direction
    poses could go on for ever, for less and less, so there the minimum is where nothing is gained.
    """
    here, exact, damping, is_open = energy.evaluate(poses, exact=False), False, GRAPH_STEPS.first, False
    iteration = 0
    for iteration in range(1, max_iterations + 1):
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
            if is_last(length, tolerance, damping, GRAPH_STEPS):
                value = float(energy.terms(trial).sum())
                if is_accepted(here.value, value, GRAPH_STEPS):
                    return Optimum(_wrapped(trial), value, iteration, True)
                return Optimum(_wrapped(poses), here.value, iteration, True)
            there = energy.evaluate(trial, exact=length < EXACT_HESSIAN_STEP)
            accepted = is_accepted(here.value, there.value, GRAPH_STEPS)
            if accepted:
                gains = here.value - there.value > NEGLIGIBLE_GAIN * (1 + here.value)
                if is_open and damping <= GRAPH_STEPS.least_raised and not gains:
                    return Optimum(_wrapped(trial), there.value, iteration, True)
                poses, here, exact = trial, there, length < EXACT_HESSIAN_STEP
        damping = next_damping(damping, accepted, GRAPH_STEPS)
        if damping > GRAPH_STEPS.greatest:
            break
    return Optimum(_wrapped(poses), here.value, iteration, False)


def newton_step(pattern: Pattern, system: System, damping: float = 0.0) -> Array | None:
    """The step (F, 3) of the free poses; None when the damped Hessian is not positive definite."""
    matrix = system.hessian
    if damping:
        matrix = matrix.copy()
        block, component = pattern.starts[:-1, None], np.arange(3)
        diagonal = matrix[block, component, component]
        # The second part is for a direction in which no relation has any information.
        matrix[block, component, component] += damping * (diagonal + 1e-9 * diagonal.max(initial=0.0))
    factor = factorise(pattern, matrix)
    return None if factor.loose.any() else -solve(factor, system.gradient)


def _wrapped(poses: Array) -> Array:
    poses = poses.copy()
    poses[:, 2] = wrap(poses[:, 2])
    return poses
