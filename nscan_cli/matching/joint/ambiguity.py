"""How far off a joint match may be where its scans fit elsewhere, too: what its Hessian does not know.

Along a corridor scans fit again and again: a door farther on, or anywhere. The Hessian knows how sharp the
place is that was found, to a centimetre. That there are others shows in the energy farther off alone, and by
the neutral one: any scans fit better by the energy itself where they cover more of each other.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.joint.gauge import gauge_directions
from nscan_cli.matching.joint.joint_energy import NEUTRAL, JointProblem
from nscan_cli.matching.joint.neutral_energy import neutral_energies
from nscan_cli.matching.joint.scan_set import with_usual
from nscan_cli.poses import Array

WEAK = 0.015
"""m; a motion that the Hessian knows better is not looked into. In rooms all are known better."""
HELD_BY_NOTHING = 1.0
"""m; a motion that the Hessian itself knows no better is known well enough for what it is."""
MOTIONS = 3
"""So many are looked into, those that it knows least."""
FARTHEST, PLACES = 1.9, 10
"""The energy is compared up to so far off (m) on both sides, at so many places on each, denser near by."""
STRIDE = 4
"""Of every so-manyth point."""
DEPENDENT = 3.0
"""Energies count for so many times less here: beams next to each other are off together."""


def with_ambiguity(problem: JointProblem, poses: Array, hessian: Array) -> Array:
    """The Hessian (3n, 3n) of a joint match at its poses (n, 3), less sure where the scans fit elsewhere.

    Along the motions of the scans against each other that it knows least, the variance grows by the mean
    square of how far off they fit as well. All else that it knows stays, and so does the gauge.
    """
    sounder = None
    for motion in _weakest_motions(poses, hessian):
        row = hessian @ motion
        known = float(motion @ row)
        if not HELD_BY_NOTHING**-2 < known < WEAK**-2:
            continue
        sounder = sounder or problem._replace(scans=with_usual(problem.scans))
        variance = _variance_along(sounder, poses, motion.reshape(-1, 3))
        # No other eigenvector has a part in this one.
        hessian = hessian - np.outer(row, row) * (variance / (1.0 + known * variance))
    return hessian


def _weakest_motions(poses: Array, hessian: Array) -> list[Array]:
    """The motions (3n,) of which a Hessian knows least, eigenvectors; two scans move apart by 1 m in each."""
    gauge = gauge_directions(poses)
    held = hessian + max(float(np.trace(hessian)), 1.0) * gauge @ gauge.T
    motions = np.linalg.eigh(held)[1][:, :MOTIONS].T
    moved = motions.reshape(len(motions), -1, 3)[:, :, :2]
    apart = np.linalg.norm(moved[:, :, None] - moved[:, None], axis=3).max(axis=(1, 2))
    return list(motions / np.maximum(apart, 1e-9)[:, None])


def _variance_along(problem: JointProblem, poses: Array, motion: Array) -> float:
    """Mean square (m²) of the way along a motion (n, 3), by how well the scans fit on it."""
    aside = FARTHEST * (np.arange(1, PLACES + 1) / PLACES) ** 1.5
    ways = np.concatenate([-aside[::-1], [0.0], aside])
    energies = neutral_energies(problem, poses + ways[:, None, None] * motion, NEUTRAL, STRIDE)
    likelihoods = np.exp((energies.min() - energies) / DEPENDENT) * np.gradient(ways)
    return float((likelihoods * ways**2).sum() / likelihoods.sum())
