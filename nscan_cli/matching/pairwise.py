"""Match one scan with another: the pose, and what is known about it (paper, III-E, III-F; [19])."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.joint.overlap import INLIER_BOUND, LEAST_OVERLAP
from nscan_cli.matching.pairwise_solver import PairProblem, minimise, objective
from nscan_cli.matching.priors import Prior
from nscan_cli.matching.uncertainty import (
    Weakest,
    covariance_of,
    decrement,
    is_settled,
    weakest_translation,
)
from nscan_cli.ndt.association import begin
from nscan_cli.ndt.energy import OUT, inlier_share
from nscan_cli.ndt.hash_grid import STRAIGHT
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, wrap

NO_OVERLAP = "no overlap"
STEP_LIMIT = "step limit"
NO_DESCENT = "no step lowers the energy"
INDEFINITE = "the Hessian is not positive definite"
HELD = "held at a cell border, where the energy jumps"


@dataclass(frozen=True)
class PairOptions:
    """How single scans become Gaussians, and how one is matched with another."""

    cell: float = 1.0
    """Side of a cell, m ([19])."""
    minimum: int = 3
    """Least number of points that make a Gaussian."""
    floor: float = 0.02
    """Least standard deviation of a Gaussian, m."""
    reach: float = 40.0
    """Longer beams are not matched, m."""
    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """One stage each: w of the energy; the last is 1, the energy itself."""
    scale: float = 0.6
    """What the energy is multiplied with to be a negative log likelihood. Found on simulated scans with
    range noise of 1.5 cm, where it makes the errors of matches as large as their covariances say."""
    max_iterations: int = 50
    """In each stage."""
    tolerance: float = 1e-5
    """A stage has converged when a step moves the pose by less (m, rad)."""


@dataclass(frozen=True)
class PairMatch:
    """The relative pose of two scans and what is known about it."""

    pose: Array
    """(3,) of the scan in the frame of the reference, eq. (2)."""
    energy: float
    """E itself, neither scaled nor with the prior."""
    gradient_norm: float
    """Of the objective, scale · E + prior."""
    decrement: float | None
    """The Newton step that is left, in standard deviations; None where there is no covariance."""
    hessian: Array
    """(3, 3) exact Hessian of the objective."""
    covariance: Array | None
    """(3, 3) its inverse; None when it is not positive definite."""
    eigenvalues: Array
    """(3,) of the Hessian, increasing."""
    weakest: Weakest
    overlap: float
    """Share of the scan's points that lie on a Gaussian of the reference."""
    iterations: int
    evaluations: int
    """These of all stages."""
    unsettled: int
    """Stages before the last that did not settle within their iterations: where they led is less sure."""
    reason: str | None
    """Why the match did not converge; None when it did."""

    @property
    def converged(self) -> bool:
        """Whether the pose is a minimum that can be relied on."""
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
    """The NDT of one scan's points (m, 2), in the frame that they are given in."""
    ends, poses = np.array([0, len(points)]), np.zeros((1, 3))
    return Ndt.of_scans(points, ends, poses, options.cell, options.minimum, options.floor, around=STRAIGHT)


def match_pair(
    reference: Ndt, points: Array, start: Array, prior: Prior | None, options: PairOptions
) -> PairMatch:
    """Match points (m, 2) of a scan with the NDT of another, from the relative pose `start` (3,).

    Minimises scale · E plus the prior (14) stage by stage. E jumps where points cross the borders of
    cells, so a minimum may be a place where the gradient is not zero: `decrement` tells how much.
    """
    prior = prior or Prior(np.zeros(3), np.zeros((3, 3)))
    problem = PairProblem(reference.grid, reference.half, begin(points), options.scale, prior)
    pose, hessian, gradient, out = start.copy(), np.empty((3, 3)), np.empty(3), np.empty(OUT)
    iterations, evaluations, last, settled = 0, 1, 0, [True]
    # One by one: the end of the last tells whether the match has converged.
    for widening in options.widenings:
        _, _, last, evaluated, ended = minimise(
            problem,
            pose,
            np.array([widening]),
            options.max_iterations,
            options.tolerance,
            options.tolerance,
            hessian,
        )
        iterations += last
        evaluations += evaluated
        settled.append(ended)
    objective(problem, pose, 1.0, 1.0, out, gradient, hessian)
    overlap = inlier_share(reference.grid, reference.half, points, pose, INLIER_BOUND)
    covariance = covariance_of(hessian)
    reason = None
    if overlap < LEAST_OVERLAP:
        reason = NO_OVERLAP
    elif not settled[-1]:
        reason = STEP_LIMIT if last == options.max_iterations else NO_DESCENT
    elif covariance is None:
        reason = INDEFINITE
    elif not is_settled(gradient, covariance):
        reason = HELD
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
        unsettled=settled[:-1].count(False),
        reason=reason,
    )
