"""nScan-Matching of chosen scans: match jointly, and leave out what fits no other (paper, III, V)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.correlative_search import SearchOptions
from nscan_cli.matching.joint.index_set import Kind, index_set
from nscan_cli.matching.joint.initialisation import match_or_search
from nscan_cli.matching.joint.joint_energy import JointProblem, Priors, all_pairs, joint_energy, no_priors
from nscan_cli.matching.joint.joint_match import JointMatch, JointOptions
from nscan_cli.matching.joint.outliers import ALONE, OUT_OF_REACH, ExcludedScan, out_of_reach, outliers
from nscan_cli.matching.joint.overlap import Overlaps
from nscan_cli.matching.joint.scan_set import lay_out
from nscan_cli.matching.joint.wall_fit import fit_to_walls
from nscan_cli.matching.pairwise import HELD, INDEFINITE, PairOptions, scan_ndt
from nscan_cli.matching.uncertainty import Weakest, covariance_of, decrement, is_settled, weakest_translation
from nscan_cli.poses import Array

NOT_SETTLED = "not settled within the steps allowed"

PriorsAmong = Callable[[Sequence[int]], Priors]
"""The priors among some of the scans: their indices → priors whose pairs count within these."""


@dataclass(frozen=True)
class NScanMatch:
    """The relation of the scans that were kept."""

    kept: tuple[int, ...]
    """Indices (k of n) of the scans of the relation among those given."""
    fixed: int
    """Index among the kept of the scan that `covariance` is relative to."""
    joint: JointMatch
    """The least energy: poses (k, 3) and exact Hessian (3k, 3k) there."""
    poses: Array
    """(k, 3) those of the least energy, fitted to the walls that the scans see in common."""
    energy: float
    """E itself, neither scaled nor with priors."""
    covariance: Array | None
    """(3k − 3, 3k − 3) of the other scans' poses, the fixed scan's held; None where H leaves them open."""
    decrement: float | None
    """The Newton step that is left, in standard deviations; None where there is no covariance."""
    pairs: NDArray[np.int64]
    """(m, 2) the index set J, indices among the kept."""
    overlap: Array
    """(k,) share of each scan's points that lie on at least one other scan."""
    weakest: tuple[Weakest, ...]
    """Of each of the k scans, the direction in which the others hold it least, in the frame of the poses:
    by the scans alone, without priors. A corridor shows here."""
    reason: str | None
    """Why the match did not converge; None when it did."""


def nscan_match(
    points: Sequence[Array],
    start: Array,
    priors_among: PriorsAmong,
    fixed: int,
    options: PairOptions,
    joint: JointOptions,
    pairs: Kind = "overlap",
) -> tuple[NScanMatch | None, list[ExcludedScan]]:
    """Match n scans with points (m_i, 2) jointly from the poses `start` (n, 3), by the index set `pairs`.

    The scan `fixed` stays where it is when `joint.fixed` is not None, and carries the covariance in any
    case. Scans that cannot meet the others are left out before, those that overlap none, and the one that
    is farthest out of the bounds of its priors, after the match; the rest is matched again from `start`.
    No match when fewer than two are left.
    """
    ndts = [scan_ndt(part, options) for part in points]
    far = out_of_reach(points, start, SearchOptions().distance)
    left_out = [ExcludedScan(scan, OUT_OF_REACH, 0.0) for scan in far]
    kept = [scan for scan in range(len(points)) if scan not in far]
    while len(kept) >= 2:
        scans = lay_out([ndts[scan] for scan in kept], [points[scan] for scan in kept])
        # The noise of one scan is in 2 (n − 1) of the pairs, that of one pair match in one.
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
            partial(index_set, pairs, scans),
        )
        known = joint_energy(problem._replace(pairs=match.pairs[:0]), match.poses)
        blocks = _blocks(problem._replace(pairs=match.pairs), match, known.hessian)
        out = outliers(shares, match.pairs, problem.priors, match.poses, blocks)
        if not out:
            fitted = fit_to_walls(scans, match.poses, match.hessian, gauge.fixed)
            energy = (match.energy - known.value) / scale
            return _relation(kept, held, match, fitted, shares, energy, blocks), left_out
        gone = [stray.scan for stray in out]
        left_out += [replace(stray, scan=kept[stray.scan]) for stray in out]
        kept = [scan for at, scan in enumerate(kept) if at not in gone]
    return None, left_out + [ExcludedScan(scan, ALONE, 0.0) for scan in kept]


def _relation(
    kept: list[int],
    held: int,
    match: JointMatch,
    poses: Array,
    shares: Overlaps,
    energy: float,
    blocks: Array,
) -> NScanMatch:
    others = np.delete(np.arange(3 * len(kept)), np.arange(3 * held, 3 * held + 3))
    covariance = covariance_of(match.hessian[np.ix_(others, others)])
    gradient = match.gradient[others]
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
        weakest=tuple(weakest_translation(block) for block in blocks),
        reason=_reason(match.converged, gradient, covariance),
    )


def _blocks(problem: JointProblem, match: JointMatch, known: Array) -> Array:
    """(n, 3, 3) what the others say of each pose: the blocks on the diagonal of the Hessian of the scans.

    That is the match's Hessian without the priors' `known` (3n, 3n). Where priors hold a scan away from its
    minimum, its curvature can be negative: there it is the semi-definite part.
    """
    blocks = _on_diagonal(match.hessian - known)
    indefinite = np.linalg.eigvalsh(blocks)[:, 0] <= 0.0
    if indefinite.any():
        definite = joint_energy(problem._replace(priors=no_priors()), match.poses, exact=False)
        blocks[indefinite] = _on_diagonal(definite.hessian)[indefinite]
    return blocks


def _on_diagonal(hessian: Array) -> Array:
    scan = np.arange(len(hessian) // 3)
    blocks: Array = hessian.reshape(len(scan), 3, len(scan), 3)[scan, :, scan, :]
    return blocks


def _reason(converged: bool, gradient: Array, covariance: Array | None) -> str | None:
    if not converged:
        return NOT_SETTLED
    if covariance is None:
        return INDEFINITE
    return None if is_settled(gradient, covariance) else HELD
