"""nScan-Matching of chosen scans: match jointly, and leave out what fits no other (paper, III, V)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.joint import JointMatch, JointOptions, match_near_and_far
from nscan_cli.matching.joint_energy import JointProblem, Priors, all_pairs, joint_energy, lay_out, no_priors
from nscan_cli.matching.overlap import LEAST_OVERLAP, Overlaps, overlaps
from nscan_cli.matching.pairwise import HELD, INDEFINITE, PairOptions, scan_ndt
from nscan_cli.matching.uncertainty import covariance_of, decrement, is_settled
from nscan_cli.poses import Array, relative, wrap

OUT_OF_BOUNDS = 16.27
"""A prior is broken at a larger squared Mahalanobis distance: 99.9 % of χ² with three degrees of freedom."""
NOT_SETTLED = "not settled within the steps allowed"
OVERLAPS_NONE = "overlaps none of the others"
BREAKS_BOUNDS = "falls outside the bounds of all its priors"

PriorsAmong = Callable[[Sequence[int]], Priors]
"""The priors among some of the scans: their indices → priors whose pairs count within these."""


@dataclass(frozen=True)
class LeftOut:
    """A scan that is no part of the relation."""

    scan: int
    """Index among the scans given."""
    reason: str
    overlap: float
    """Its greatest share of points in common with one other scan."""


@dataclass(frozen=True)
class NScanMatch:
    """The relation of the scans that were kept."""

    kept: tuple[int, ...]
    """Indices (k of n) of the scans of the relation among those given."""
    fixed: int
    """Index among the kept of the scan that `covariance` is relative to."""
    joint: JointMatch
    """Poses (k, 3) and exact Hessian (3k, 3k)."""
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
    reason: str | None
    """Why the match did not converge; None when it did."""


def nscan_match(
    points: Sequence[Array],
    start: Array,
    priors_among: PriorsAmong,
    fixed: int,
    options: PairOptions,
    joint: JointOptions,
) -> tuple[NScanMatch | None, list[LeftOut]]:
    """Match n scans with points (m_i, 2) jointly from the poses `start` (n, 3), all pairs.

    The scan `fixed` stays where it is when `joint.fixed` is not None, and carries the covariance in any
    case. Scans that overlap none of the others, and a scan that breaks all its priors, are left out, and
    the rest is matched again from `start`. No match when fewer than two are left.
    """
    ndts = [scan_ndt(part, options) for part in points]
    kept, left_out = list(range(len(points))), list[LeftOut]()
    while len(kept) >= 2:
        scans = lay_out([ndts[scan] for scan in kept], [points[scan] for scan in kept])
        pairs, priors = all_pairs(len(kept)), priors_among(kept)
        # The noise of one scan is in 2 (n − 1) of the pairs, that of one pair match in one.
        scale = 2 * options.scale / len(kept)
        problem = JointProblem(scans, pairs, priors, scale)
        held = kept.index(fixed) if fixed in kept else 0
        gauge = replace(joint, fixed=None if joint.fixed is None else held)
        match = match_near_and_far(problem, start[kept], gauge)
        shares = overlaps(scans, match.poses)
        strays = _strays(shares, priors, match.poses)
        if not strays:
            at_end = joint_energy(problem, match.poses)
            alone = joint_energy(JointProblem(scans, pairs, no_priors(), 1.0), match.poses)
            others = np.delete(np.arange(3 * len(kept)), np.arange(3 * held, 3 * held + 3))
            covariance = covariance_of(match.hessian[np.ix_(others, others)])
            gradient = at_end.gradient[others]
            return NScanMatch(
                kept=tuple(kept),
                fixed=held,
                joint=match,
                energy=alone.value,
                covariance=covariance,
                decrement=None if covariance is None else decrement(gradient, covariance),
                pairs=pairs,
                overlap=shares.scans,
                reason=_reason(match.converged, gradient, covariance),
            ), left_out
        best = np.maximum(shares.pairs, shares.pairs.T).max(axis=0)
        left_out += [LeftOut(kept[at], reason, float(best[at])) for at, reason in strays]
        kept = [scan for at, scan in enumerate(kept) if at not in dict(strays)]
    return None, left_out + [LeftOut(scan, OVERLAPS_NONE, 0.0) for scan in kept]


def _reason(converged: bool, gradient: Array, covariance: Array | None) -> str | None:
    if not converged:
        return NOT_SETTLED
    if covariance is None:
        return INDEFINITE
    return None if is_settled(gradient, covariance) else HELD


def _strays(shares: Overlaps, priors: Priors, poses: Array) -> list[tuple[int, str]]:
    """The scans that do not belong to the others: all that overlap none, otherwise one out of bounds."""
    best = np.maximum(shares.pairs, shares.pairs.T).max(axis=0)
    apart = np.flatnonzero(best < LEAST_OVERLAP).tolist()
    if apart:
        return [(at, OVERLAPS_NONE) for at in apart]
    i, j = priors.pairs.T
    off = relative(poses[j], poses[i]) - priors.means
    off[:, 2] = wrap(off[:, 2])
    broken = np.einsum("qa,qab,qb->q", off, priors.information, off) > OUT_OF_BOUNDS
    n = len(poses)
    count, breaks = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    for scans in (i, j):
        np.add.at(count, scans, 1)
        np.add.at(breaks, scans, broken)
    # A scan that is wrong breaks the priors of its neighbours too: the one with the most goes first.
    out = np.flatnonzero((breaks == count) & (count > 0))
    return [(int(out[np.argmax(count[out])]), BREAKS_BOUNDS)] if len(out) else []
