"""Pairwise matching: the relative pose of two scans and its uncertainty (paper, III-E, III-F; [19])."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise_solver import PairProblem, minimise_pairwise, pairwise_objective
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
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, wrap

NO_OVERLAP = "no overlap"
STEP_LIMIT = "step limit"
NO_DESCENT = "no step lowers the energy"


@dataclass(frozen=True)
class PairOptions:
    """How single scans become Gaussians, and how one is matched with another."""

    cell: float = 1.0
    """Side of a cell, m ([19]). Larger cells converge from farther away, and describe walls more coarsely."""
    minimum: int = 3
    """Least number of points that make a Gaussian. A larger number leaves out what few beams hit."""
    floor: float = 0.02
    """Least standard deviation of a Gaussian, m. A larger value makes walls softer."""
    reach: float = 40.0
    """Longest beam that is matched, m."""
    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """The w of the energy in each stage; the last is 1, the energy itself. Smaller first values converge from
    farther away."""
    scale: float = 0.6
    """Factor that makes a negative log likelihood of the energy. On simulated scans with range noise of 1.5
    cm the errors of matches are as large as their covariances with this value; a larger one makes these
    smaller."""
    max_iterations: int = 50
    """Most iterations in each stage."""
    tolerance: float = 1e-5
    """A stage has converged when a step moves the pose by less, m and rad."""
    coarse_tolerance: float = 1e-5
    """The same of the stages before the last. With a larger one a match is quicker, and its last stage begins
    farther from where it ends."""
    inlier_bound: float = 9.0
    """Squared Mahalanobis distance from a Gaussian within which a point lies on it."""
    least_overlap: float = 0.1
    """A match with a smaller share of the scan's points on the reference has not converged."""
    convergence: ConvergenceOptions = field(default_factory=ConvergenceOptions)


@dataclass(frozen=True)
class PairMatch:
    """The relative pose of two scans and its uncertainty."""

    pose: Array
    """(3,) of the scan in the frame of the reference, eq. (2)."""
    energy: float
    """E, neither scaled nor with the prior."""
    gradient_norm: float
    """That of the objective, scale · E + prior."""
    decrement: float | None
    """Length of the remaining Newton step in standard deviations; None without a covariance."""
    hessian: Array
    """(3, 3) exact Hessian of the objective."""
    covariance: Array | None
    """(3, 3) inverse of the Hessian; None when that is not positive definite."""
    eigenvalues: Array
    """(3,) those of the Hessian, increasing."""
    weakest: Weakest
    overlap: float
    """Share of the scan's points that lie on a Gaussian of the reference."""
    iterations: int
    """Number in all stages."""
    evaluations: int
    """Number of evaluations of the energy in all stages."""
    unsettled: int
    """Stages before the last that did not converge within their iterations, so that the pose is less
    certain."""
    reason: str | None
    """Why the match did not converge; None when it did."""

    @property
    def converged(self) -> bool:
        """Whether the pose is a reliable minimum."""
        return self.reason is None


class PairEnd(NamedTuple):
    """Where the match of two scans has ended, without its uncertainty."""

    pose: Array
    """(3,) of the scan in the frame of the reference."""
    energy: float
    """E before the last step."""
    overlap: float
    """Share of the scan's points that lie on a Gaussian of the reference."""
    converged: bool
    """Whether the last stage has ended by its tolerance."""


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
    return Ndt.of_scans(
        points, ends, poses, options.cell, options.minimum, options.floor, neighbourhood=WALL_DIRECTION
    )


def settle_pair(
    reference: Ndt, points: Array, start: Array, options: PairOptions, prior: Prior | None = None
) -> PairEnd:
    """Match points (m, 2) of a scan as `match_pair` does; quick, for what asks for no uncertainty."""
    prior = prior or Prior(np.zeros(3), np.zeros((3, 3)))
    problem = PairProblem(reference.grid, reference.half, begin_association(points), options.scale, prior)
    pose = start.copy()
    _, energy, _, _, converged = minimise_pairwise(
        problem,
        pose,
        np.array(options.widenings),
        options.max_iterations,
        options.coarse_tolerance,
        options.tolerance,
        np.empty((3, 3)),
    )
    pose[2] = wrap(pose[2])
    overlap = inlier_share(reference.grid, reference.half, points, pose, options.inlier_bound)
    return PairEnd(pose, energy, overlap, converged)


def match_pair(
    reference: Ndt, points: Array, start: Array, prior: Prior | None, options: PairOptions
) -> PairMatch:
    """Match points (m, 2) of a scan with the NDT of another, from the relative pose `start` (3,).

    Minimises scale · E plus the prior (14) stage by stage. E jumps where points cross the borders of cells,
    so the gradient at a minimum need not be zero: `decrement` tells the step that is left.
    """
    prior = prior or Prior(np.zeros(3), np.zeros((3, 3)))
    problem = PairProblem(reference.grid, reference.half, begin_association(points), options.scale, prior)
    pose, hessian, gradient, out = start.copy(), np.empty((3, 3)), np.empty(3), np.empty(ENERGY_NUMBERS)
    iterations, evaluations, last, converged = 0, 1, 0, [True]
    # One stage a call: whether the match has converged depends on the last stage alone.
    tolerances = [options.coarse_tolerance] * (len(options.widenings) - 1) + [options.tolerance]
    for widening, enough in zip(options.widenings, tolerances, strict=True):
        _, _, last, evaluated, ended = minimise_pairwise(
            problem, pose, np.array([widening]), options.max_iterations, enough, enough, hessian
        )
        iterations += last
        evaluations += evaluated
        converged.append(ended)
    pairwise_objective(problem, pose, 1.0, 1.0, out, gradient, hessian)
    overlap = inlier_share(reference.grid, reference.half, points, pose, options.inlier_bound)
    covariance = covariance_of(hessian)
    if overlap < options.least_overlap:
        reason: str | None = NO_OVERLAP
    elif not converged[-1]:
        reason = STEP_LIMIT if last == options.max_iterations else NO_DESCENT
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
        weakest=weakest_translation(hessian),
        overlap=overlap,
        iterations=iterations,
        evaluations=evaluations,
        unsettled=converged[:-1].count(False),
        reason=reason,
    )
