"""Relations of any type as pairwise relations, by the marginals of their Hessians, for g2o files."""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.relations.base import Relation
from nscan_cli.graph.relations.pairwise import Pairwise
from nscan_cli.poses import Array, inverse, relative, rotated_information

LEAST_EIGENVALUE_SHARE = 1e-9
"""Lower bound of the eigenvalues of a marginal's information, as a share of its greatest one."""


def pairwise_marginals(relation: Relation, poses: Array) -> list[Pairwise]:
    """A relation as pairwise relations from pose c to each other pose, which loses correlations.

    With pose c held fixed, the information on pose i alone is the Schur complement H_ii − H_ir H_rr⁺ H_ri
    over all other poses r. Where H has an inverse, that is the inverse of pose i's block of the covariance.
    It is turned from the relation's frame into that of pose c. A term that is not linear is taken at the
    global poses (n, 3).

    Directions that the relation does not hold get next to no information (LEAST_EIGENVALUE_SHARE). With none
    at all, readers that factorise by Cholesky's method (GTSAM) would make much out of rounding. The Hessian's
    negative eigenvalues count as 0.
    """
    term = relation.term()
    local, hessian, c, _ = term if term.at is None else term.at(poses)
    others = np.delete(np.arange(len(relation.nodes)), c)
    free = (3 * others[:, None] + np.arange(3)).ravel()
    to_frame_of_c = inverse(local[c])
    measurements = relative(local[others], local[c])
    return [
        Pairwise(
            nodes=(relation.nodes[c], relation.nodes[index]),
            measurement=measurement,
            information=rotated_information(to_frame_of_c, information),
            origin=relation.origin,
            score=relation.score,
        )
        for index, measurement, information in zip(
            others, measurements, _marginal_blocks(hessian[np.ix_(free, free)]), strict=True
        )
    ]


def _marginal_blocks(information: Array) -> Array:
    """The information (m, 3, 3) on each of m poses alone, from that on all of them (3 m, 3 m)."""
    m = len(information) // 3
    eigenvalues, vectors = np.linalg.eigh(information)
    if eigenvalues[0] > 1e-9 * eigenvalues[-1]:
        covariance = (vectors / eigenvalues) @ vectors.T
        blocks = np.linalg.inv(covariance.reshape(m, 3, m, 3)[np.arange(m), :, np.arange(m)])
    else:
        H = (vectors * np.maximum(eigenvalues, 0)) @ vectors.T
        blocks = np.empty((m, 3, 3))
        for block in range(m):
            i = np.arange(3 * block, 3 * block + 3)
            r = np.delete(np.arange(3 * m), i)
            H_ir = H[np.ix_(i, r)]
            blocks[block] = H[np.ix_(i, i)] - H_ir @ np.linalg.pinv(H[np.ix_(r, r)], 1e-12, True) @ H_ir.T
    eigenvalues, vectors = np.linalg.eigh(0.5 * (blocks + blocks.transpose(0, 2, 1)))
    held = np.maximum(eigenvalues, LEAST_EIGENVALUE_SHARE * eigenvalues[:, -1:])
    sound: Array = (vectors * held[:, None, :]) @ vectors.transpose(0, 2, 1)
    return 0.5 * (sound + sound.transpose(0, 2, 1))
