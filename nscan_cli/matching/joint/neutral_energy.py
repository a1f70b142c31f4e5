"""The neutral energy of n scans: the joint energy without its reward for overlap.

E rewards every point that meets a Gaussian, so that it falls when scans are slid over each other. The neutral
energy takes that reward away: a point counts s less a share of what s usually is on the scan that it meets.
Its derivatives are the same; it serves for comparing places.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.joint.joint_energy import JointProblem, Room, add_priors, room_for
from nscan_cli.matching.joint.scan_set import scan_grid, scan_points
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.ndt.energy import accumulate
from nscan_cli.poses import Array

COVERING = 0.78
"""The share where covering more of each other shall count; with NEUTRAL it does not."""


def pair_energies(problem: JointProblem, poses: Array, share: float = COVERING, stride: int = 1) -> Array:
    """The neutral energy of each pair at the poses (n, 3): (n, n), 0 where (i, j) is not in J.

    With a stride only every so-manyth point is counted.
    """
    values = np.zeros((len(poses), len(poses)))
    _each_pair(problem, poses, share, stride, room_for(problem.scans, stride), values)
    return values


def neutral_energy(problem: JointProblem, poses: Array, share: float = COVERING, stride: int = 1) -> float:
    """The neutral energy with priors at the poses (n, 3)."""
    return float(neutral_energies(problem, poses[None], share, stride)[0])


@kernel
def neutral_energies(problem: JointProblem, poses: Array, share: float, stride: int) -> Array:
    """The neutral energy with priors at each of k times n poses (k, n, 3): (k,)."""
    n, room = poses.shape[1], room_for(problem.scans, stride)
    energies, values = np.empty(len(poses)), np.zeros((n, n))
    gradient, hessian = np.zeros(3 * n), np.zeros((3 * n, 3 * n))
    for k in range(len(poses)):
        _each_pair(problem, poses[k], share, stride, room, values)
        energies[k] = values.sum() + add_priors(problem.priors, poses[k], 0.0, gradient, hessian)
    return energies


@leaf_kernel
def _each_pair(
    problem: JointProblem, poses: Array, share: float, stride: int, room: Room, values: Array
) -> None:
    scans, u = problem.scans, room.u
    for pair in range(problem.pairs.shape[0]):
        i, j = problem.pairs[pair, 0], problem.pairs[pair, 1]
        relative_pose(poses[j], poses[i], u)
        accumulate(
            scan_grid(scans, i),
            scans.half,
            scan_points(scans, j),
            u[0],
            u[1],
            u[2],
            1.0,
            0.0,
            share * scans.usual[i],
            stride,
            room.met,
            room.out,
        )
        values[i, j] = stride * problem.scale * room.out[0]
