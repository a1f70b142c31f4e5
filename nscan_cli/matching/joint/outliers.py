"""Outlier scans, which do not belong to the others: found before a joint match or by it (paper, V: open)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.matching.joint.joint_energy import Priors
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import Overlaps
from nscan_cli.poses import Array, Indices, relative, relative_jacobians, wrap

TOO_FAR = "starts too far from all other scans to overlap any"
OVERLAPS_NONE = "overlaps none of the others"
IN_NO_PAIR = "is in no pair of the index set"
CONTRADICTS_PRIORS = "contradicts its priors"
ONLY_ONE_LEFT = "is the only one left"


@dataclass(frozen=True)
class ExcludedScan:
    """A scan that is not part of the relation."""

    scan: int
    """Index among the scans given."""
    reason: str
    overlap: float
    """Its greatest overlap with one other scan."""
    chi2: float | None = None
    """Squared deviation from its priors if that is the reason, else None; see squared_deviations."""


def too_far(points: Sequence[Array], start: Array, error: float) -> list[int]:
    """The scans that can overlap no other, even if their poses `start` (n, 3) were wrong by `error` (m).

    A scan extends to the distance of its farthest point in all directions, since its angle may be wrong, too.
    """
    radii = np.array([np.hypot(part[:, 0], part[:, 1]).max(initial=0.0) for part in points])
    away = start[:, None, :2] - start[None, :, :2]
    gaps = np.hypot(away[..., 0], away[..., 1]) - radii[:, None] - radii[None, :]
    np.fill_diagonal(gaps, np.inf)
    return [int(scan) for scan in np.flatnonzero(gaps.min(axis=1, initial=np.inf) > error)]


def outliers(
    shares: Overlaps,
    pairs: Indices,
    priors: Priors,
    poses: Array,
    information: Array,
    options: JointOptions,
) -> list[ExcludedScan]:
    """The scans that do not belong to the others at the poses (n, 3) of a match by the index set (m, 2).

    They are all that overlap no other or are in no pair. If there are none, it is the one that contradicts
    its priors most, if any does. `information` (n, 3, 3) is that of the match on each pose.
    """
    best = np.maximum(shares.pairs, shares.pairs.T).max(axis=0)
    paired = np.isin(np.arange(len(poses)), pairs)
    lost = [
        ExcludedScan(at, IN_NO_PAIR if share >= options.least_overlap else OVERLAPS_NONE, share)
        for at, share in enumerate(best.tolist())
        if share < options.least_overlap or not paired[at]
    ]
    if lost:
        return lost
    from scipy.special import chdtri

    bound = float(chdtri(3, options.outlier_probability))
    by_all, by_most = squared_deviations(priors, poses, information)
    # Only the worst: a wrong scan makes its neighbours contradict the priors that they share with it.
    worst = int(np.argmax(np.where(by_most > bound, by_all, 0.0)))
    chi2 = float(by_most[worst])
    if chi2 <= bound:
        return []
    reason = f"{CONTRADICTS_PRIORS} (χ² {chi2:.1f}, at most {bound:.2f})"
    return [ExcludedScan(worst, reason, float(best[worst]), chi2)]


def squared_deviations(priors: Priors, poses: Array, information: Array) -> tuple[Array, Array]:
    """The squared deviations of n matched poses (n, 3) from their priors: two (n,), 3 degrees of freedom.

    With the other scans where they were matched, a scan's priors together are a Gaussian on its pose. The
    first result is the deviation from it. The second leaves out the one of several priors that the scan
    contradicts most, since odometry that slipped once makes no outlier. Both are 0 without a prior.
    """
    pulls, known = _on_scans(priors, poses)
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
    """δᵗ (Λ⁻¹ + S⁻¹)⁻¹ δ of poses: their deviations δ from Gaussians, by the uncertainty of both, (m,).

    `prior` (m, 3, 3) is the Gaussians' information Λ, and `pull` (m, 3) is Λδ. `match` (m, 3, 3),
    semi-definite, is S, the information of the match on the pose with the other scans fixed; their own
    uncertainty is small against that of priors. A direction that the match leaves open, as in a corridor, has
    no weight.
    """
    # Λ (Λ⁻¹ + S⁻¹)⁻¹ Λ is Λ⁻¹ − (Λ + S)⁻¹ between two Λ, and needs no inverse of S.
    between = np.linalg.pinv(prior, hermitian=True) - np.linalg.pinv(prior + match, hermitian=True)
    deviations: Array = np.einsum("ma,mab,mb->m", pull, between, pull)
    return deviations


def _on_scans(priors: Priors, poses: Array) -> tuple[Array, Array]:
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
