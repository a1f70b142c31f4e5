"""nScan-Matching of chosen scans: match jointly, and exclude outliers (paper, III, V)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from nscan_cli.matching.joint.index_set import IndexSetKind, index_set
from nscan_cli.matching.joint.initialisation import match_or_search
from nscan_cli.matching.joint.joint_energy import JointProblem, Priors, all_pairs, joint_energy, no_priors
from nscan_cli.matching.joint.joint_match import JointMatch
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.outliers import ONLY_ONE_LEFT, TOO_FAR, ExcludedScan, outliers, too_far
from nscan_cli.matching.joint.overlap import Overlaps
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.joint.wall_fit import fit_to_walls
from nscan_cli.matching.pairwise import PairOptions, scan_ndt
from nscan_cli.matching.uncertainty import (
    Weakest,
    covariance_of,
    decrement,
    weakest_translation,
    why_no_minimum,
)
from nscan_cli.poses import Array, Indices

NOT_CONVERGED = "did not converge within the steps allowed"

PriorsAmong = Callable[[Sequence[int]], Priors]
"""Indices of some scans → the priors among them, whose pairs are positions among these indices."""


@dataclass(frozen=True)
class NScanMatch:
    """The relation of the scans that were kept."""

    kept: tuple[int, ...]
    """Indices (k of n) of the scans of the relation among those given."""
    fixed: int
    """Index among the kept scans of the one that `covariance` is relative to."""
    joint: JointMatch
    """The minimum of the energy: poses (k, 3) and exact Hessian (3k, 3k)."""
    poses: Array
    """(k, 3) the poses of the minimum, fitted to the walls that several scans see."""
    energy: float
    """E, neither scaled nor with priors."""
    covariance: Array | None
    """(3k − 3, 3k − 3) of the other scans' poses relative to the fixed one; None if H is singular there."""
    decrement: float | None
    """Length of the remaining Newton step in standard deviations; None without a covariance."""
    pairs: Indices
    """(m, 2) the index set J, indices among the kept."""
    overlap: Array
    """(k,) the share of each scan's points that lie on at least one other scan."""
    weakest: tuple[Weakest, ...]
    """k directions, in the frame of the poses, in which the other scans hold each scan least. Priors do not
    count, so a corridor shows here."""
    reason: str | None
    """Why the match did not converge; None when it did."""


def nscan_match(
    points: Sequence[Array],
    start: Array,
    priors_among: PriorsAmong,
    fixed: int,
    options: PairOptions,
    joint: JointOptions,
    pairs: IndexSetKind = "overlap",
) -> tuple[NScanMatch | None, list[ExcludedScan]]:
    """Match n scans with points (m_i, 2) jointly from the poses `start` (n, 3), by the index set `pairs`.

    The covariance is relative to the scan `fixed`, which stays where it is if `joint.fixed` is not None.
    Scans that start too far from all others are excluded before the match. After it, those that overlap no
    other are excluded; if there are none, the one that contradicts its priors most is, if any does. Then the
    rest is matched again from `start`.
    Returns the match, None if fewer than two scans are left, and the excluded scans.
    """
    ndts = [scan_ndt(part, options) for part in points]
    far = too_far(points, start, joint.initialisation.search.distance)
    excluded = [ExcludedScan(scan, TOO_FAR, 0.0) for scan in far]
    kept = [scan for scan in range(len(points)) if scan not in far]
    while len(kept) >= 2:
        scans = scan_set([ndts[scan] for scan in kept], [points[scan] for scan in kept])
        # The noise of a scan takes part in 2 (n − 1) pairs here, and in one in a pairwise match.
        scale = 2 * options.scale / len(kept)
        problem = JointProblem(scans, all_pairs(len(kept)), priors_among(kept), scale)
        held = kept.index(fixed) if fixed in kept else 0
        gauge = replace(joint, fixed=None if joint.fixed is None else held)
        match, shares = match_or_search(
            problem,
            [points[scan] for scan in kept],
            start[kept],
            options,
            gauge,
            partial(index_set, pairs, joint.index_set, scans),
        )
        priors = joint_energy(problem._replace(pairs=match.pairs[:0]), match.poses)
        blocks = _pose_information(problem._replace(pairs=match.pairs), match, priors.hessian)
        out = outliers(shares, match.pairs, problem.priors, match.poses, blocks, joint)
        if not out:
            fitted = fit_to_walls(scans, match.poses, match.hessian, gauge.fixed, joint.wall_fit)
            energy = (match.energy - priors.value) / scale
            return _nscan(kept, held, match, fitted, shares, energy, blocks, options), excluded
        indices = [outlier.scan for outlier in out]
        excluded += [replace(outlier, scan=kept[outlier.scan]) for outlier in out]
        kept = [scan for index, scan in enumerate(kept) if index not in indices]
    return None, excluded + [ExcludedScan(scan, ONLY_ONE_LEFT, 0.0) for scan in kept]


def _nscan(
    kept: list[int],
    held: int,
    match: JointMatch,
    poses: Array,
    shares: Overlaps,
    energy: float,
    information: Array,
    options: PairOptions,
) -> NScanMatch:
    others = np.delete(np.arange(3 * len(kept)), np.arange(3 * held, 3 * held + 3))
    covariance = covariance_of(match.hessian[np.ix_(others, others)])
    gradient = match.gradient[others]
    no_minimum = why_no_minimum(gradient, covariance, options.convergence)
    return NScanMatch(
        kept=tuple(kept),
        fixed=held,
        joint=match,
        poses=poses,
        energy=energy,
        covariance=covariance,
        decrement=None if covariance is None else decrement(gradient, covariance),
        pairs=match.pairs,
        overlap=shares.scans,
        weakest=tuple(weakest_translation(each, options.weak_sigma) for each in information),
        reason=no_minimum if match.converged else NOT_CONVERGED,
    )


def _pose_information(problem: JointProblem, match: JointMatch, priors: Array) -> Array:
    """(n, 3, 3) the information of the other scans on each pose: the diagonal blocks of the scans' Hessian.

    That is the Hessian of the match minus that of the priors (3n, 3n). Where priors hold a scan away from its
    minimum, the curvature can be negative; the block is then that of the semi-definite part.
    """
    blocks = _diagonal_blocks(match.hessian - priors)
    indefinite = np.linalg.eigvalsh(blocks)[:, 0] <= 0.0
    if indefinite.any():
        definite = joint_energy(problem._replace(priors=no_priors()), match.poses, exact=False)
        blocks[indefinite] = _diagonal_blocks(definite.hessian)[indefinite]
    return blocks


def _diagonal_blocks(hessian: Array) -> Array:
    scan = np.arange(len(hessian) // 3)
    blocks: Array = hessian.reshape(len(scan), 3, len(scan), 3)[scan, :, scan, :]
    return blocks
