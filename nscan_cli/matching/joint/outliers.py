"""Scans that do not belong to the others, found before a joint match or by its result (paper, V: open)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.joint.joint_energy import Priors
from nscan_cli.matching.joint.overlap import LEAST_OVERLAP, Overlaps
from nscan_cli.poses import Array, relative, relative_jacobians, wrap

OUTLIER_PROBABILITY = 0.001
"""A scan is an outlier where its priors give such a χ² with a smaller probability."""
OUT_OF_REACH = "starts too far from all others to meet one"
OVERLAPS_NONE = "overlaps none of the others"
IN_NO_PAIR = "is in no pair of the index set"
OUT_OF_BOUNDS = "falls outside the bounds of its priors"
ALONE = "is the only one left"


@dataclass(frozen=True)
class ExcludedScan:
    """A scan that is no part of the relation."""

    scan: int
    """Index among the scans given."""
    reason: str
    overlap: float
    """Its greatest share of points in common with one other scan."""
    chi2: float | None = None
    """Squared deviation from what its priors say, where that is the reason; see squared_deviations."""


def out_of_reach(points: Sequence[Array], start: Array, reach: float) -> list[int]:
    """The scans that can meet no other, even if their poses `start` (n, 3) were off by `reach` (m).

    A scan may reach as far as its farthest point, in any direction: how it is turned may be wrong as well.
    """
    radii = np.array([np.hypot(part[:, 0], part[:, 1]).max(initial=0.0) for part in points])
    away = start[:, None, :2] - start[None, :, :2]
    gaps = np.hypot(away[..., 0], away[..., 1]) - radii[:, None] - radii[None, :]
    np.fill_diagonal(gaps, np.inf)
    return [int(scan) for scan in np.flatnonzero(gaps.min(axis=1, initial=np.inf) > reach)]


def outliers(
    shares: Overlaps, pairs: NDArray[np.int64], priors: Priors, poses: Array, information: Array
) -> list[ExcludedScan]:
    """The scans that do not belong to the others at the poses (n, 3) of a match by the index set (m, 2).

    All that overlap none or are in no pair; when there is none of these, the one that is farthest out of
    its bounds. `information` (n, 3, 3) is what the match says of each pose.
    """
    best = np.maximum(shares.pairs, shares.pairs.T).max(axis=0)
    paired = np.isin(np.arange(len(poses)), pairs)
    lost = [
        ExcludedScan(at, IN_NO_PAIR if share >= LEAST_OVERLAP else OVERLAPS_NONE, share)
        for at, share in enumerate(best.tolist())
        if share < LEAST_OVERLAP or not paired[at]
    ]
    if lost:
        return lost
    from scipy.special import chdtri

    bound = float(chdtri(3, OUTLIER_PROBABILITY))
    by_all, by_most = squared_deviations(priors, poses, information)
    # Only the worst: a scan that is wrong takes its neighbours along, which have one prior less that fits.
    worst = int(np.argmax(np.where(by_most > bound, by_all, 0.0)))
    chi2 = float(by_most[worst])
    if chi2 <= bound:
        return []
    return [
        ExcludedScan(worst, f"{OUT_OF_BOUNDS} (χ² {chi2:.1f}, at most {bound:.2f})", float(best[worst]), chi2)
    ]


def squared_deviations(priors: Priors, poses: Array, information: Array) -> tuple[Array, Array]:
    """How far each of n matched poses (n, 3) is from what its priors say: two (n,), three degrees of freedom.

    With the other scans where they were matched, a scan's priors together are a Gaussian on its pose. The
    first result is the deviation from that; for the second, of several priors the one that the scan
    disagrees with most is left out: an odometry that slipped once puts no scan out of bounds, a scan at a
    wrong place disagrees with all. Both are 0 without a prior.
    """
    pulls, known = _seen_from_scans(priors, poses)
    n = len(poses)
    pull, prior, count = np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros(n, dtype=np.int64)
    np.add.at(pull, priors.pairs, pulls)
    np.add.at(prior, priors.pairs, known)
    np.add.at(count, priors.pairs, 1)
    by_all = squared_deviation(pull, prior, information)
    by_most = by_all.copy()
    several = np.argwhere(count[priors.pairs] > 1)
    scans, terms = priors.pairs[tuple(several.T)], tuple(several.T)
    without = squared_deviation(pull[scans] - pulls[terms], prior[scans] - known[terms], information[scans])
    np.minimum.at(by_most, scans, without)
    return by_all, by_most


def squared_deviation(pull: Array, prior: Array, match: Array) -> Array:
    """δᵗ (Λ⁻¹ + S⁻¹)⁻¹ δ of poses: their deviations δ from Gaussians against the uncertainty of both, (m,).

    `prior` (m, 3, 3) are the Gaussians' information Λ, and `pull` (m, 3) is Λδ. `match` (m, 3, 3),
    semi-definite, is S: what the match by itself says of the pose with the other scans held. Their own
    uncertainty, which a marginal would add, is small against that of priors. A direction that the match
    leaves open, as in a corridor, has no weight.
    """
    # Λ (Λ⁻¹ + S⁻¹)⁻¹ Λ is Λ⁻¹ − (Λ + S)⁻¹ between two Λ, and needs no inverse of S.
    between = np.linalg.pinv(prior, hermitian=True) - np.linalg.pinv(prior + match, hermitian=True)
    deviations: Array = np.einsum("ma,mab,mb->m", pull, between, pull)
    return deviations


def _seen_from_scans(priors: Priors, poses: Array) -> tuple[Array, Array]:
    """Pull (Q, 2, 3) and information (Q, 2, 3, 3) of each prior on the poses of its two scans, eq. (9)."""
    pulls, known = np.zeros((len(priors.pairs), 2, 3)), np.zeros((len(priors.pairs), 2, 3, 3))
    for q, ((a, b), mean, weight) in enumerate(zip(*priors, strict=True)):
        off = relative(poses[b], poses[a]) - mean
        off[2] = wrap(off[2])
        by_b, by_a = relative_jacobians(poses[b], poses[a])
        for end, jacobian in enumerate((by_a, by_b)):
            pulls[q, end] = jacobian.T @ weight @ off
            known[q, end] = jacobian.T @ weight @ jacobian
    return pulls, known
