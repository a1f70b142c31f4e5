"""The uncertainty of a joint match whose scans fit elsewhere, too: what its Hessian does not know.

Along a corridor scans fit again one door farther on, or anywhere. The Hessian tells only how sharp the
minimum is. Other minima show in the energy farther away, and only in the neutral energy, since the energy
itself falls wherever scans cover more of each other.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.joint.gauge import gauge_directions
from nscan_cli.matching.joint.joint_energy import NEUTRAL, JointProblem
from nscan_cli.matching.joint.neutral_energy import neutral_energies
from nscan_cli.matching.joint.options import AmbiguityOptions
from nscan_cli.matching.joint.scan_set import with_usual
from nscan_cli.poses import Array


def with_ambiguity(problem: JointProblem, poses: Array, hessian: Array, options: AmbiguityOptions) -> Array:
    """The Hessian (3n, 3n) of a joint match at its poses (n, 3), reduced where scans fit elsewhere.

    Along the least certain motions of the scans against each other, the variance grows by the mean square of
    the distances at which they fit as well. Other directions and the gauge keep their information.
    """
    neutral = None
    for motion in _weakest_motions(poses, hessian, options.motions):
        row = hessian @ motion
        information = float(motion @ row)
        if not options.greatest_sigma**-2 < information < options.least_sigma**-2:
            continue
        neutral = neutral or problem._replace(scans=with_usual(problem.scans))
        variance = _variance_along(neutral, poses, motion.reshape(-1, 3), options)
        # The motion is an eigenvector, so no other direction changes.
        hessian = hessian - np.outer(row, row) * (variance / (1.0 + information * variance))
    return hessian


def _weakest_motions(poses: Array, hessian: Array, count: int) -> list[Array]:
    """The eigenvectors (3n,) of least information, scaled so that in each two scans move apart by 1 m."""
    gauge = gauge_directions(poses)
    held = hessian + max(float(np.trace(hessian)), 1.0) * gauge @ gauge.T
    motions = np.linalg.eigh(held)[1][:, :count].T
    moved = motions.reshape(len(motions), -1, 3)[:, :, :2]
    apart = np.linalg.norm(moved[:, :, None] - moved[:, None], axis=3).max(axis=(1, 2))
    return list(motions / np.maximum(apart, 1e-9)[:, None])


def _variance_along(problem: JointProblem, poses: Array, motion: Array, options: AmbiguityOptions) -> float:
    """Mean square (m²) of the distance along a motion (n, 3), weighed by how well the scans fit there."""
    aside = options.distance * (np.arange(1, options.places + 1) / options.places) ** options.spread
    distances = np.concatenate([-aside[::-1], [0.0], aside])
    trials = poses + distances[:, None, None] * motion
    energies = neutral_energies(problem, trials, NEUTRAL, options.stride)
    likelihoods = np.exp((energies.min() - energies) / options.correlation) * np.gradient(distances)
    return float((likelihoods * distances**2).sum() / likelihoods.sum())
