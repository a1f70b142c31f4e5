"""Step 1: one scan matched with the local map, from one start."""

from __future__ import annotations

from nscan_cli.kernels.array_assignment import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise_solver import PairProblem, minimise_pairwise
from nscan_cli.ndt.association import begin_association, count_inliers, update_association
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingParameters
from nscan_cli.slam.frontend.track_state import TrackingProblem


@kernel
def match_and_count(
    grid: Grid, settings: TrackingParameters, points: Array, prior: Prior, pose: Array, hessian: Array
) -> tuple[float, float]:
    """Minimise from `pose` (3,), in place; the objective's value, and the share of inliers there.

    Writes the Hessian (3, 3) of the objective.
    """
    meeting = begin_association(points)
    problem = PairProblem(grid, settings.half, meeting, settings.options.scale, prior)
    limits = settings.options.max_iterations, settings.coarse_tolerance, settings.options.tolerance
    value = minimise_pairwise(problem, pose, settings.widenings, *limits, hessian).value
    update_association(grid, settings.half, meeting, pose)
    return value, count_inliers(meeting, settings.options.inlier_bound) / max(points.shape[0], 1)


@kernel
def match_from_prediction(problem: TrackingProblem, points: Array, k: int) -> None:
    """Match the points (m, 2) of scan k from its prediction; writes what is found of it."""
    found, prior = problem.found, problem.prior
    assign(found.poses[k], prior.mean)
    found.values[k], found.inliers[k] = match_and_count(
        problem.grid, problem.settings, points, prior, found.poses[k], found.hessians[k]
    )
