"""The motion model of odometry, and the prior on a step that follows from it (paper, III-E, eq. (14))."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.poses import Array, relative


class Prior(NamedTuple):
    """A Gaussian on a relative pose u, as −log: ½ (u − z)ᵗ P (u − z)."""

    mean: Array
    """(3,) z"""
    information: Array
    """(3, 3) P"""


@leaf_kernel
def prior_value(prior: Prior, pose: Array) -> float:
    """The prior's part of the objective at a pose (3,), eq. (14)."""
    mean, information = prior
    x, y, turn = pose[0] - mean[0], pose[1] - mean[1], wrapped(pose[2] - mean[2])
    square = x * x * information[0, 0] + y * y * information[1, 1] + turn * turn * information[2, 2]
    across = x * y * information[0, 1] + x * turn * information[0, 2] + y * turn * information[1, 2]
    return float(0.5 * square + across)


class MotionModel(NamedTuple):
    """Standard deviations of a step of the odometry.

    They are large on purpose: wheels slip, and carts are pushed. A strong prior breaks maps where the
    odometry is wrong, and scans know better where it is right. Larger values weaken the prior.
    """

    distance: float = 0.05
    """Standard deviation of the position without any motion, m."""
    distance_per_metre: float = 0.2
    """Increase of it for each metre travelled."""
    angle: float = 0.05
    """Standard deviation of the angle without any motion, rad."""
    angle_per_radian: float = 0.2
    """Increase of it for each radian turned."""
    angle_per_metre: float = 0.1
    """Increase of it for each metre travelled, rad."""


@kernel
def motion_sigmas(step: Array, motion: MotionModel) -> tuple[float, float]:
    """Standard deviations of a step (3,): of its position in x and in y (m), and of its angle (rad)."""
    distance = np.hypot(step[0], step[1])
    along = motion.distance + motion.distance_per_metre * distance
    turned = motion.angle_per_radian * abs(step[2]) + motion.angle_per_metre * distance
    return along, motion.angle + turned


def odometry_prior(reference: Array, pose: Array, model: MotionModel) -> Prior:
    """The prior on pose ⊖ reference from the odometry poses (3,) of two scans."""
    step = relative(pose, reference)
    along, about = motion_sigmas(step, model)
    return Prior(step, np.diag([along**-2, along**-2, about**-2]))
