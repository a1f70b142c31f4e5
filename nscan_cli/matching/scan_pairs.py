"""The match of two scans in one call, for those who make many: no NDT is kept.

As `pairwise`, from which the options come; a call takes a quarter of the time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise import PairOptions
from nscan_cli.matching.pairwise_solver import PairProblem, minimise_pairwise, pairwise_objective
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.matching.small_matrices import information_of_place
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS, inlier_share
from nscan_cli.ndt.grid_growth import CELLS_PER_POINT, add_points, make_all_gaussians
from nscan_cli.ndt.hash_grid import WALL_DIRECTION, empty_grid
from nscan_cli.ndt.transform import grid_settings
from nscan_cli.poses import Array


class ScanPair(NamedTuple):
    """Where the match of two scans has ended."""

    pose: Array
    """(3,) of the scan in the frame of the reference."""
    energy: float
    """E before the last step."""
    overlap: float
    """Share of the scan's points that lie on a Gaussian of the reference."""
    converged: bool
    """Whether the last stage has ended by its tolerance."""
    gradient: Array
    """(3,) of the objective."""
    information: Array
    """(3, 3) exact Hessian of the objective."""
    apart: float
    """How far from `pose` a second match has ended, m and rad; 0 without one."""


def match_scans(
    reference: Array,
    points: Array,
    start: Array,
    options: PairOptions,
    probe: float = 0.0,
    is_near: bool = False,
) -> ScanPair:
    """Match points (m, 2) of a scan with those (n, 2) of another, from the relative pose `start` (3,).

    A second match begins `probe` (m) away from where the first has ended, in its least certain direction.
    Without it gradient and information are 0. From a start that `is_near` the minimum the first stage is
    left out.
    """
    pose, gradient, information = start.copy(), np.zeros(3), np.zeros((3, 3))
    widenings = options.widenings[1:] if is_near else options.widenings
    stages = np.array([*widenings, options.coarse_tolerance, options.tolerance])
    settings = grid_settings(options, WALL_DIRECTION, faces=True)
    numbers = np.array([0.5 * options.cell, options.scale, options.inlier_bound, probe])
    energy, overlap, converged, apart = _match(
        reference, points, pose, settings, stages, options.max_iterations, numbers, gradient, information
    )
    return ScanPair(pose, energy, overlap, converged, gradient, information, apart)


@kernel
def _match(
    reference: Array,
    points: Array,
    pose: Array,
    settings: Array,
    stages: Array,
    max_iterations: int,
    numbers: Array,
    gradient: Array,
    information: Array,
) -> tuple[float, float, bool, float]:
    """Energy, overlap, convergence and distance of the second match, as ScanPair has them; writes the rest.

    `stages` are the widenings and two tolerances, `numbers` (4,) the side (m) of a lattice cell, the scale of
    E, the bound of inliers and how far off (m) the second match begins.
    """
    half, scale, bound, probe = numbers[0], numbers[1], numbers[2], numbers[3]
    widenings, near, tolerance = stages[:-2], stages[-2], stages[-1]
    m = reference.shape[0]
    # It is used for one match, so it is not made smaller.
    grid = empty_grid(CELLS_PER_POINT * m, settings)
    rows = add_points(grid, 0, half, reference, np.zeros(3), 1.0, np.empty(m, dtype=np.int32))
    make_all_gaussians(grid, rows, half)
    hessian, prior = np.empty((3, 3)), Prior(np.zeros(3), np.zeros((3, 3)))
    problem = PairProblem(grid, half, begin_association(points), scale, prior)
    found = minimise_pairwise(problem, pose, widenings, max_iterations, near, tolerance, hessian)
    pose[2] = wrapped(pose[2])
    overlap, apart = inlier_share(grid, half, points, pose, bound), 0.0
    if probe > 0.0:
        pairwise_objective(problem, pose, 1.0, 1.0, np.empty(ENERGY_NUMBERS), gradient, information)
        # The rotation is unknown, too. Of two eigenvectors, the one of the smaller eigenvalue.
        xx, xy, yy = information_of_place(information)
        weakest = 0.5 * np.arctan2(2.0 * xy, xx - yy) + 0.5 * np.pi
        again, step = pose.copy(), np.empty(3)
        again[0] += probe * np.cos(weakest)
        again[1] += probe * np.sin(weakest)
        minimise_pairwise(problem, again, widenings, max_iterations, near, tolerance, hessian)
        relative_pose(again, pose, step)
        apart = max(abs(step[0]), abs(step[1]), abs(wrapped(step[2])))
    return found.energy, overlap, found.converged, apart
