"""The poses that minimise the energy of a graph: sparse damped Newton steps (paper, IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from nscan_cli.graph.system import GraphEnergy, System
from nscan_cli.poses import Array, wrap

LEAST_DAMPING = 1e-12
GREATEST_DAMPING = 1e8


@dataclass(frozen=True)
class Optimum:
    """Poses (K, 3) at a minimum, the energy there, and how it was reached."""

    poses: Array
    energy: float
    iterations: int
    converged: bool


def optimise(
    energy: GraphEnergy, poses: Array, max_iterations: int = 50, tolerance: float = 1e-6, damping: float = 0.0
) -> Optimum:
    """Minimise from the poses (K, 3) until a step moves no pose by more than `tolerance` (m, rad).

    Gauss–Newton steps while the poses move far, the exact Hessian (25) when they settle; Levenberg's
    damping when a step would raise the energy.
    """
    here, exact = energy.evaluate(poses, exact=False), False
    iterations = 0
    while iterations < max_iterations:
        iterations += 1
        step = _step(here, damping)
        trial = poses.copy()
        trial.reshape(-1)[energy.kept] += step
        length = float(np.abs(step).max(initial=0.0))
        there = energy.evaluate(trial, exact)
        if there.value <= here.value:
            poses, here = trial, there
            damping = 0.1 * damping if damping > LEAST_DAMPING else 0.0
        elif length > tolerance:
            damping = max(10 * damping, 1e-6)
            if damping > GREATEST_DAMPING:
                break
            continue
        if length <= tolerance:
            return Optimum(_wrapped(poses), here.value, iterations, True)
    return Optimum(_wrapped(poses), here.value, iterations, False)


def _step(system: System, damping: float) -> Array:
    matrix = system.hessian
    if damping:
        matrix = csc_array(matrix + diags_array(damping * system.hessian.diagonal()))
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    step: Array = -factor.solve(system.gradient)
    return step


def _wrapped(poses: Array) -> Array:
    poses = poses.copy()
    poses[:, 2] = wrap(poses[:, 2])
    return poses
