"""Pairwise matching: the relative pose of two scans and its uncertainty (paper, III-E, III-F; [19])."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.motion_model import Prior, no_prior
from nscan_cli.matching.pairwise_solver import (
    PairProblem,
    minimise_pairwise,
    pairwise_objective,
)
from nscan_cli.matching.uncertainty import (
    ConvergenceOptions,
    Weakest,
    covariance_of,
    decrement,
    weakest_translation,
    why_no_minimum,
)
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS, inlier_share
from nscan_cli.ndt.hash_grid import WALL_DIRECTION
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, wrap

NO_OVERLAP = "no overlap"
STEP_LIMIT = "step limit"
NO_DESCENT = "no step lowers the energy"


@dataclass(frozen=True)
class PairOptions(GaussianOptions):
    """How single scans become Gaussians, and how one is matched with another."""

    cell: float = 1.0
    """Side of a cell, m ([19]). Larger cells converge from farther away, and describe walls more coarsely."""
    minimum: int = 3
    """Least number of points that make a Gaussian. A larger number leaves out what few beams hit."""
    reach: float = 40.0
    """Longest beam that is matched, m. A larger value sees more and takes longer."""
    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """The w of the energy in each stage of a match: it multiplies the information of the Gaussians, so that
    w < 1 widens them. The last w is 1. With larger ones before, matches converge only from nearer."""
    scale: float = 0.6
    """Factor that makes a negative log likelihood of the energy. With this value matches of simulated scans
    with range noise of 1.5 cm are as far off as their covariances say. A larger value makes covariances
    smaller."""
    max_iterations: int = 50
    """Most iterations in each stage. A larger number lets slow matches converge."""
    tolerance: float = 1e-5
    """The last stage has converged when a step moves the pose by less, m and rad. A larger value ends it
    earlier."""
    coarse_tolerance: float = 1e-5
    """A stage before the last has converged when a step moves the pose by less, m and rad. With a larger
    value a match is quicker, and its last stage begins farther from where it ends."""
    inlier_bound: float = 9.0
    """A point lies on a Gaussian within this squared Mahalanobis distance. A larger value counts more
    points."""
    least_overlap: float = 0.1
    """A match with a smaller share of the scan's points on the reference has not converged. A larger value
    refuses more matches."""
    weak_sigma: float = 0.05
    """A match is weak if its standard deviation in some direction is larger, m. In rooms it is 0.003 to
    0.015, in a corridor without any doors about 0.1. With a larger value fewer matches are weak."""
    convergence: ConvergenceOptions = field(default_factory=ConvergenceOptions)
    """The Newton step that may be left at a minimum."""


@dataclass(frozen=True)
class PairMatch:
    """The relative pose of two scans and its uncertainty."""

    pose: Array
    """(3,) of the scan in the frame of the reference, eq. (2)."""
    energy: float
    """E, neither scaled nor with the prior."""
    gradient_norm: float
    """Length of the gradient of the objective, scale · E + prior."""
    decrement: float | None
    """Length of the remaining Newton step in standard deviations; None without a covariance."""
    hessian: Array
    """(3, 3) exact Hessian of the objective."""
    covariance: Array | None
    """(3, 3) inverse of the Hessian; None when that is not positive definite."""
    eigenvalues: Array
    """(3,) eigenvalues of the Hessian, increasing."""
    weakest: Weakest
    """The direction in which the position is least certain."""
    overlap: float
    """Share of the scan's points that lie on a Gaussian of the reference."""
    iterations: int
    """Number of iterations in all stages."""
    evaluations: int
    """Number of evaluations of the energy in all stages."""
    unsettled: int
    """Number of stages before the last that did not converge, so that the pose is less certain."""
    reason: str | None
    """Why the match did not converge; None when it did."""

    @property
    def converged(self) -> bool:
        """Whether the pose is a reliable minimum."""
        return self.reason is None


def matched_points(log: LaserLog, row: int, options: PairOptions) -> Array:
    """The end points (m, 2) of a scan's beams within reach, in the robot's frame.

    Raises InputDataError when there are not enough for one Gaussian.
    """
    ranges = log.ranges[row]
    points: Array = log.points(row)[ranges[np.isfinite(ranges)] <= options.reach]
    if len(points) < options.minimum:
        problem = f"scan {log.numbers[row]} has {len(points)} usable beams within {options.reach:g} m"
        raise InputDataError(log.source.name, problem, "choose another scan")
    return points


def scan_ndt(points: Array, options: PairOptions) -> Ndt:
    """The NDT of one scan's points (m, 2), in their own frame."""
    ends, poses = np.array([0, len(points)]), np.zeros((1, 3))
    return Ndt.of_scans(points, ends, poses, options, neighbourhood=WALL_DIRECTION)


def match_pair(
    reference: Ndt, points: Array, start: Array, prior: Prior | None, options: PairOptions
) -> PairMatch:
    """Match points (m, 2) of a scan with the NDT of another, from the relative pose `start` (3,).

    Minimises scale · E plus the prior (14) stage by stage. E jumps where points cross the borders of cells,
    so the gradient at a minimum need not be zero. `decrement` tells the step that is left.
    """
    association = begin_association(points)
    problem = PairProblem(reference.grid, reference.half, association, options.scale, prior or no_prior())
    pose, limits = start.copy(), (options.max_iterations, options.coarse_tolerance, options.tolerance)
    found = minimise_pairwise(problem, pose, np.array(options.widenings), *limits, np.empty((3, 3)))
    hessian, gradient, out = np.empty((3, 3)), np.empty(3), np.empty(ENERGY_NUMBERS)
    pairwise_objective(problem, pose, 1.0, 1.0, out, gradient, hessian)
    overlap = inlier_share(reference.grid, reference.half, points, pose, options.inlier_bound)
    covariance = covariance_of(hessian)
    if overlap < options.least_overlap:
        reason: str | None = NO_OVERLAP
    elif not found.converged:
        reason = STEP_LIMIT if found.last_iterations == options.max_iterations else NO_DESCENT
    else:
        reason = why_no_minimum(gradient, covariance, options.convergence)
    return PairMatch(
        pose=np.array([pose[0], pose[1], float(wrap(pose[2]))]),
        energy=float(out[0]),
        gradient_norm=float(np.linalg.norm(gradient)),
        decrement=None if covariance is None else decrement(gradient, covariance),
        hessian=hessian,
        covariance=covariance,
        eigenvalues=np.linalg.eigvalsh(hessian).astype(np.float64),
        weakest=weakest_translation(hessian, options.weak_sigma),
        overlap=overlap,
        iterations=found.iterations,
        evaluations=found.evaluations + 1,
        unsettled=found.unsettled,
        reason=reason,
    )
