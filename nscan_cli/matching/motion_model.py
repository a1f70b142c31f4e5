"""The motion model of odometry, and the prior on a step that follows from it (paper, III-E, eq. (14))."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Array, relative

Triple = tuple[float, float, float]


class Prior(NamedTuple):
    """A Gaussian on a relative pose u. Its negative logarithm is ½ (u − z)ᵗ P (u − z), eq. (14)."""

    mean: Array
    """(3,) z"""
    information: Array
    """(3, 3) P"""


def no_prior() -> Prior:
    """A prior that says nothing."""
    return Prior(np.zeros(3), np.zeros((3, 3)))


@leaf_kernel
def prior_pull(prior: Prior, pose: Array) -> tuple[Triple, Triple]:
    """u − z at a relative pose u (3,), and the prior's gradient there, P (u − z)."""
    mean, information = prior
    turn = pose[2] - mean[2]
    off = pose[0] - mean[0], pose[1] - mean[1], turn - 2 * np.pi * np.round(turn / (2 * np.pi))
    return off, (_row(information[0], off), _row(information[1], off), _row(information[2], off))


@leaf_kernel
def _row(row: Array, vector: Triple) -> float:
    total = 0.0
    for a in range(3):
        total += row[a] * vector[a]
    return total


@leaf_kernel
def prior_value(prior: Prior, pose: Array) -> float:
    """The prior's part of the objective at a relative pose (3,), eq. (14)."""
    (x, y, turn), pull = prior_pull(prior, pose)
    return 0.5 * (x * pull[0] + y * pull[1] + turn * pull[2])


class MotionModel(NamedTuple):
    """Standard deviations of a step of the odometry.

    They are large on purpose: wheels slip, and carts are pushed. A strong prior breaks maps where the
    odometry is wrong, and scans know better where it is right.
    """

    distance: float = 0.05
    """Standard deviation of the position without any motion, m. A larger value trusts the scans more."""
    distance_per_metre: float = 0.2
    """Increase of the position's standard deviation with each metre travelled, m/m. A larger value trusts the
    scans more on long steps."""
    angle: float = 0.05
    """Standard deviation of the angle without any motion, rad. A larger value trusts the scans more."""
    angle_per_radian: float = 0.2
    """Increase of the angle's standard deviation with each radian turned, rad/rad. A larger value trusts the
    scans more in turns."""
    angle_per_metre: float = 0.1
    """Increase of the angle's standard deviation with each metre travelled, rad/m. A larger value trusts the
    scans more on long steps."""


@kernel
def motion_sigmas(step: Array, motion: MotionModel) -> tuple[float, float]:
    """The standard deviations of a step (3,): of its position in x and in y, m, and of its angle, rad."""
    distance = np.hypot(step[0], step[1])
    along = motion.distance + motion.distance_per_metre * distance
    turned = motion.angle_per_radian * abs(step[2]) + motion.angle_per_metre * distance
    return along, motion.angle + turned


def odometry_prior(reference: Array, pose: Array, model: MotionModel) -> Prior:
    """The prior on pose ⊖ reference from the odometry poses (3,) of two scans."""
    step = relative(pose, reference)
    along, about = motion_sigmas(step, model)
    return Prior(step, np.diag([along**-2, along**-2, about**-2]))
