"""nScan-Matching: find the poses of n scans that minimise their joint energy (paper, III)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.joint.gauge import gauge_of
from nscan_cli.matching.joint.joint_energy import NEUTRAL, JointProblem, joint_energy
from nscan_cli.matching.joint.joint_solver import approach, approach_and_finish
from nscan_cli.matching.joint.neutral_energy import COVERING, neutral_energy
from nscan_cli.matching.joint.overlap import SOUND_OVERLAP, overlaps, weakest_link
from nscan_cli.matching.joint.weak_directions import replace_weak_directions
from nscan_cli.poses import Array, wrap

PairsAt = Callable[[Array], NDArray[np.int64]]
"""The index set J (m, 2) at the poses (n, 3)."""


@dataclass(frozen=True)
class JointOptions:
    """How a joint match is minimised."""

    widenings: tuple[float, ...] = (0.05, 0.3, 1.0)
    """Stages of the approach: w of the energy; 1 is the energy itself, in which the last steps are done."""
    near: float = 0.01
    """A wide stage is left when no pose moves by more (m, rad), the one of w = 1 at half of that."""
    stride: int = 2
    """On the approach every so-manyth point is matched."""
    approach_iterations: int = 30
    """In each stage of the approach."""
    max_iterations: int = 30
    """In the last stage."""
    tolerance: float = 1e-4
    """The match has converged when no pose moves by more (m, rad)."""
    thorough: bool = True
    """Whether energy and derivatives are those after the last step, and not those before it."""
    fixed: int | None = None
    """The scan that stays where it is; None leaves the gauge free (paper, III-D)."""

    @property
    def of_approach(self) -> tuple[int, int, int, float, bool]:
        """Stride, gauge, iterations, near and thorough, as the kernels take them."""
        return self.stride, gauge_of(self.fixed), self.approach_iterations, self.near, self.thorough


@dataclass(frozen=True)
class JointMatch:
    """The result of nScan matching: local poses and the Hessian there."""

    poses: Array
    """(n, 3)"""
    gradient: Array
    """(3n,) of the objective at the poses."""
    hessian: Array
    """(3n, 3n) exact Hessian of the objective at the poses, the gauge still in it."""
    pairs: NDArray[np.int64]
    """(m, 2) the index set J at the end."""
    energy: float
    """The objective's: scale · E with priors."""
    iterations: int
    evaluations: int
    last_iterations: int
    """Those of the iterations that were done in the last stage."""
    unsettled: int
    """Stages of the way here before the last that did not settle within their iterations."""
    converged: bool
    searched: bool = False
    """Whether the scans were placed by search, because the start led nowhere."""

    @property
    def gradient_norm(self) -> float:
        """Of the objective."""
        return float(np.linalg.norm(self.gradient))


class Approached(NamedTuple):
    """Where an approach has come."""

    poses: Array
    iterations: int
    evaluations: int
    unsettled: int
    """Stages that did not settle."""

    def further(self, iterations: int, evaluations: int, unsettled: int) -> Approached:
        """The way after so many more; the poses have moved by themselves."""
        return Approached(
            self.poses,
            self.iterations + iterations,
            self.evaluations + evaluations,
            self.unsettled + unsettled,
        )


def match_jointly(problem: JointProblem, start: Array, options: JointOptions) -> JointMatch:
    """Minimise the joint energy from the poses `start` (n, 3), stage by stage.

    The steps are Newton's, eq. (5) to (8), damped as by Levenberg and Marquardt: with the semi-definite
    part of the Hessian in the wide stages, with the exact one in the last where it is positive definite.
    """
    return _finish(problem, Approached(start.copy(), 0, 0, 0), options, options.widenings, neutral=False)


def match_near_and_far(
    problem: JointProblem, start: Array, options: JointOptions, pairs_at: PairsAt | None = None
) -> JointMatch:
    """Approach in two ways from `start` (n, 3), and finish from where the neutral energy is lower.

    Through all stages a far optimum is found; but the reward for overlap slides scans together where a
    corridor leaves them room. There they go back to where the priors want them, if that is no worse. By the
    energy itself, judged by the neutral one, they stay apart from the start; but only a near optimum is
    found. If the scans hang together, covering more of each other counts no further. `pairs_at` chooses the
    index set again before each stage; the pairs of `problem` serve for comparison.
    """
    last = options.widenings[-1:]
    far = _approach(problem, start, options, options.widenings, neutral=False, pairs_at=pairs_at)
    near = _approach(problem, start, options, last, neutral=True, pairs_at=pairs_at)
    ways = [far, near]
    opened = replace_weak_directions(problem, far.poses)
    if opened is not None:
        back = _approach(problem, opened, options, last, neutral=True, pairs_at=pairs_at)
        ways.append(back)
        far = min(back, far, key=partial(_judge, problem, options, NEUTRAL))
    together = weakest_link(overlaps(problem.scans, far.poses).pairs) >= SOUND_OVERLAP
    best = min(far, near, key=partial(_judge, problem, options, NEUTRAL if together else COVERING))
    work = best._replace(
        iterations=sum(way.iterations for way in ways),
        evaluations=sum(way.evaluations for way in ways) + len(ways),
    )
    return _finish(_at(problem, pairs_at, best.poses), work, options, (), neutral=True)


def _judge(problem: JointProblem, options: JointOptions, share: float, way: Approached) -> float:
    return neutral_energy(problem, way.poses, share, options.stride)


def _approach(
    problem: JointProblem,
    start: Array,
    options: JointOptions,
    widenings: tuple[float, ...],
    neutral: bool,
    pairs_at: PairsAt | None = None,
) -> Approached:
    way = Approached(start.copy(), 0, 0, 0)
    for part in [widenings] if pairs_at is None else [(widening,) for widening in widenings]:
        at = _at(problem, pairs_at, way.poses)
        way = way.further(*approach(at, way.poses, np.array(part), neutral, *options.of_approach))
    return way


def _finish(
    problem: JointProblem, way: Approached, options: JointOptions, widenings: tuple[float, ...], neutral: bool
) -> JointMatch:
    """What is left of an approach, and the last steps with the exact Hessian."""
    poses, n = way.poses, len(way.poses)
    gradient, hessian = np.empty(3 * n), np.empty((3 * n, 3 * n))
    value, last, converged, *approached = approach_and_finish(
        problem,
        poses,
        np.array(widenings),
        neutral,
        options.of_approach,
        options.max_iterations,
        options.tolerance,
        gradient,
        hessian,
    )
    way = way.further(*approached)
    if neutral:
        # The derivatives are the same.
        value = joint_energy(problem, poses).value
        way = way.further(0, 1, 0)
    poses[:, 2] = wrap(poses[:, 2])
    return JointMatch(
        poses=poses,
        gradient=gradient,
        hessian=hessian,
        pairs=problem.pairs,
        energy=value,
        iterations=way.iterations,
        evaluations=way.evaluations,
        last_iterations=last,
        unsettled=way.unsettled,
        converged=converged,
    )


def _at(problem: JointProblem, pairs_at: PairsAt | None, poses: Array) -> JointProblem:
    return problem if pairs_at is None else problem._replace(pairs=pairs_at(poses))
