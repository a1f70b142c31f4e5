"""Directions in which the scans of a joint match hold each other hardly, and the priors say more."""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.joint.joint_energy import JointProblem, joint_energy, no_priors
from nscan_cli.poses import Array

SHARE = 0.05
"""In a direction where so much of the knowledge comes from the priors, the scans do not decide. Along a
corridor without doors it is mostly a quarter or more, across it 0.0002 or less."""


def replace_weak_directions(problem: JointProblem, poses: Array) -> Array | None:
    """The poses (n, 3) moved to where the priors want them, in the directions that the scans leave open.

    Wide Gaussians slide scans together along a corridor, and nothing there brings them back; what the
    slide has found across the corridor and in rotation stays. None when the scans hold all directions.
    """
    from scipy.linalg import eigh

    if not len(problem.priors.pairs):
        return None
    scans = joint_energy(problem._replace(priors=no_priors()), poses, exact=False).hessian[3:, 3:]
    priors = joint_energy(problem._replace(pairs=problem.pairs[:0]), poses, exact=False)
    known = scans + priors.hessian[3:, 3:]
    known += 1e-9 * np.trace(known) / len(known) * np.eye(len(known))
    # The share λ of the priors in each direction v: H_priors v = λ H v, with vᵗHv = 1.
    shares, directions = eigh(priors.hessian[3:, 3:], known)
    open_ = shares > SHARE
    if not open_.any():
        return None
    along = directions[:, open_]
    moved = poses.copy()
    moved[1:] -= (along @ (along.T @ priors.gradient[3:] / shares[open_])).reshape(-1, 3)
    return moved
