"""Directions in which the scans of a joint match hardly hold each other, so that priors decide."""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.joint.joint_energy import JointProblem, joint_energy, no_priors
from nscan_cli.poses import Array


def replace_weak_directions(problem: JointProblem, poses: Array, prior_share: float) -> Array | None:
    """The poses (n, 3), moved to where the priors want them in the directions that the scans leave open.

    A direction is open if more than `prior_share` of its information comes from the priors. Wide Gaussians
    slide scans together along a corridor, and nothing there brings them back. What the match has found across
    the corridor and in rotation stays. Returns None if the scans hold all directions.
    """
    from scipy.linalg import eigh

    if not len(problem.priors.pairs):
        return None
    scans = joint_energy(problem._replace(priors=no_priors()), poses, exact=False).hessian[3:, 3:]
    priors = joint_energy(problem._replace(pairs=problem.pairs[:0]), poses, exact=False)
    information = scans + priors.hessian[3:, 3:]
    information += 1e-9 * np.trace(information) / len(information) * np.eye(len(information))
    # The share λ of the priors in each direction v: H_priors v = λ H v, with vᵗHv = 1.
    shares, directions = eigh(priors.hessian[3:, 3:], information)
    open_ = shares > prior_share
    if not open_.any():
        return None
    along = directions[:, open_]
    moved = poses.copy()
    moved[1:] -= (along @ (along.T @ priors.gradient[3:] / shares[open_])).reshape(-1, 3)
    return moved
