"""nScan-Matching: find the poses of n scans that minimise their joint energy (paper, III)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from nscan_cli.matching.joint.joint_energy import NEUTRAL, JointProblem, joint_energy
from nscan_cli.matching.joint.joint_solver import descend
from nscan_cli.matching.joint.neutral_energy import neutral_energy
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import overlaps, weakest_link
from nscan_cli.matching.joint.weak_directions import replace_weak_directions
from nscan_cli.poses import Array, Indices, wrap

PairsAt = Callable[[Array], Indices]
"""The index set J (m, 2) at the poses (n, 3)."""


@dataclass(frozen=True)
class JointMatch:
    """The result of nScan matching: local poses and the Hessian there."""

    poses: Array
    """(n, 3) local poses."""
    gradient: Array
    """(3n,) of the objective at the poses."""
    hessian: Array
    """(3n, 3n) exact Hessian of the objective at the poses, the gauge still in it."""
    pairs: Indices
    """(m, 2) the index set J at the end."""
    energy: float
    """The objective at the poses: scale · E with priors."""
    iterations: int
    """Number of iterations in all stages."""
    evaluations: int
    """Number of evaluations of the energy in all stages."""
    last_iterations: int
    """Number of iterations in the last stage."""
    unsettled: int
    """Number of stages before the last that did not converge."""
    converged: bool
    """Whether the last stage converged."""
    searched: bool = False
    """Whether the poses come from scans that were placed by search, because the start led to nothing
    better."""

    @property
    def gradient_norm(self) -> float:
        """Length of the gradient of the objective, scale · E with priors."""
        return float(np.linalg.norm(self.gradient))


class Approach(NamedTuple):
    """Poses (n, 3) that an approach led to, and what it took."""

    poses: Array
    """(n, 3)"""
    iterations: int
    """Number of iterations in all its stages."""
    evaluations: int
    """Number of evaluations of the energy in all its stages."""
    unsettled: int
    """Number of its stages that did not converge."""


def match_jointly(problem: JointProblem, start: Array, options: JointOptions) -> JointMatch:
    """Minimise the joint energy from the poses `start` (n, 3), stage by stage.

    The steps are Newton's, eq. (5) to (8), damped as by Levenberg and Marquardt: with the semi-definite
    part of the Hessian in the wide stages, with the exact one in the last where it is positive definite.
    """
    reached = _approach(problem, start, options, options.widenings, neutral=False)
    return _last_stage(problem, reached, options, neutral=False)


def match_near_and_far(
    problem: JointProblem, start: Array, options: JointOptions, pairs_at: PairsAt | None = None
) -> JointMatch:
    """Approach in two ways from `start` (n, 3), and finish from where the neutral energy is lower.

    The approach through all stages finds a far optimum, but its reward for overlap slides scans together
    along corridors. In such directions they go back to where the priors want them, if the neutral energy is
    no higher there. The approach by the last stage and the neutral energy slides nothing, but finds only a
    near optimum. If the scans are connected by overlap, more overlap counts no further. `pairs_at` chooses
    the index set again before each stage; the pairs of `problem` serve for comparison.
    """
    last = options.widenings[-1:]
    far = _approach(problem, start, options, options.widenings, neutral=False, pairs_at=pairs_at)
    near = _approach(problem, start, options, last, neutral=True, pairs_at=pairs_at)
    approaches = [far, near]
    opened = replace_weak_directions(problem, far.poses, options.prior_share)
    if opened is not None:
        back = _approach(problem, opened, options, last, neutral=True, pairs_at=pairs_at)
        approaches.append(back)
        far = min(back, far, key=partial(_neutral_energy, problem, options, NEUTRAL))
    shares = overlaps(problem.scans, far.poses, options.inlier_bound)
    connected = weakest_link(shares.pairs) >= options.sound_overlap
    share = NEUTRAL if connected else options.overlap_reward
    best = min(far, near, key=partial(_neutral_energy, problem, options, share))
    total = best._replace(
        iterations=sum(each.iterations for each in approaches),
        evaluations=sum(each.evaluations for each in approaches) + len(approaches),
    )
    return _last_stage(_with_pairs(problem, pairs_at, best.poses), total, options, neutral=True)


def _neutral_energy(problem: JointProblem, options: JointOptions, share: float, reached: Approach) -> float:
    return neutral_energy(problem, reached.poses, share, options.stride)


def _approach(
    problem: JointProblem,
    start: Array,
    options: JointOptions,
    widenings: tuple[float, ...],
    neutral: bool,
    pairs_at: PairsAt | None = None,
) -> Approach:
    poses, totals = start.copy(), np.zeros(3, dtype=np.int64)
    for part in [widenings] if pairs_at is None else [(widening,) for widening in widenings]:
        chosen = _with_pairs(problem, pairs_at, poses)
        stages = np.array([(each, options.near if each < 1.0 else 0.5 * options.near) for each in part])
        _, *counts = descend(chosen, poses, stages, False, neutral, options.approach, *_derivatives(poses))
        totals += counts
    return Approach(poses, *totals.tolist())


def _last_stage(problem: JointProblem, reached: Approach, options: JointOptions, neutral: bool) -> JointMatch:
    """The last stage after an approach, with the exact Hessian."""
    poses, (gradient, hessian) = reached.poses, _derivatives(reached.poses)
    stages = np.array([(1.0, options.tolerance)])
    value, last, evaluations, unsettled = descend(
        problem, poses, stages, True, neutral, options.last_stage, gradient, hessian
    )
    if neutral:
        # The derivatives of both energies are the same.
        value, evaluations = joint_energy(problem, poses).value, evaluations + 1
    poses[:, 2] = wrap(poses[:, 2])
    return JointMatch(
        poses=poses,
        gradient=gradient,
        hessian=hessian,
        pairs=problem.pairs,
        energy=value,
        iterations=reached.iterations + last,
        evaluations=reached.evaluations + evaluations,
        last_iterations=last,
        unsettled=reached.unsettled,
        converged=unsettled == 0,
    )


def _derivatives(poses: Array) -> tuple[Array, Array]:
    """Room for a gradient (3n,) and a Hessian (3n, 3n)."""
    n = len(poses)
    return np.empty(3 * n), np.empty((3 * n, 3 * n))


def _with_pairs(problem: JointProblem, pairs_at: PairsAt | None, poses: Array) -> JointProblem:
    return problem if pairs_at is None else problem._replace(pairs=pairs_at(poses))
