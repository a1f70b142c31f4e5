"""The neutral energy of n scans: the joint energy without its reward for overlap.

E rewards every point that meets a Gaussian, so it falls when scans slide over each other. In the neutral
energy a point counts s minus a share of the usual s of the scan that it meets. It serves to compare poses.
Its derivatives are those of E.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.joint.joint_energy import JointProblem, PairBuffers, add_priors, buffers_for
from nscan_cli.matching.joint.scan_set import scan_grid, scan_points
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.ndt.energy import evaluate_energy
from nscan_cli.poses import Array


def pair_energies(problem: JointProblem, poses: Array, share: float) -> Array:
    """The neutral energy of each pair at the poses (n, 3): (n, n), 0 where (i, j) is not in J."""
    values = np.zeros((len(poses), len(poses)))
    _write_pair_energies(problem, poses, share, 1, buffers_for(problem.scans, 1), values)
    return values


def neutral_energy(problem: JointProblem, poses: Array, share: float, stride: int = 1) -> float:
    """The neutral energy with priors at the poses (n, 3).

    A point lowers it if its s exceeds this `share` of the usual s. Of the points, one in `stride` counts for
    all.
    """
    return float(neutral_energies(problem, poses[None], share, stride)[0])


@kernel
def neutral_energies(problem: JointProblem, poses: Array, share: float, stride: int) -> Array:
    """The neutral energy with priors at each of k times n poses (k, n, 3): (k,)."""
    n, buffers = poses.shape[1], buffers_for(problem.scans, stride)
    energies, values = np.empty(len(poses)), np.zeros((n, n))
    gradient, hessian = np.zeros(3 * n), np.zeros((3 * n, 3 * n))
    for k in range(len(poses)):
        _write_pair_energies(problem, poses[k], share, stride, buffers, values)
        energies[k] = values.sum() + add_priors(problem.priors, poses[k], 0.0, gradient, hessian)
    return energies


@leaf_kernel
def _write_pair_energies(
    problem: JointProblem, poses: Array, share: float, stride: int, buffers: PairBuffers, values: Array
) -> None:
    """Write the neutral energy of each pair of J to values (n, n); others stay."""
    scans, u = problem.scans, buffers.u
    for pair in range(problem.pairs.shape[0]):
        i, j = problem.pairs[pair, 0], problem.pairs[pair, 1]
        relative_pose(poses[j], poses[i], u)
        grid, points, baseline = scan_grid(scans, i), scan_points(scans, j), share * scans.usual[i]
        evaluate_energy(grid, scans.half, points, u, 1.0, 0.0, baseline, stride, buffers.met, buffers.out)
        values[i, j] = stride * problem.scale * buffers.out[0]
