"""What is known of a relative pose before matching: the odometry as a prior (paper, III-E, eq. (14))."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, relative


class Prior(NamedTuple):
    """−log of a Gaussian on a relative pose u: ½ (u − z)ᵗ P (u − z)."""

    mean: Array
    """(3,) z"""
    information: Array
    """(3, 3) P"""


@dataclass(frozen=True)
class MotionModel:
    """Standard deviations of an odometry step of d metres and a turn of a radians.

    Wide on purpose: wheels slip and carts are pushed, and what the odometry says beyond that the scans
    say better. A strong prior breaks maps where the odometry does.
    """

    distance: float = 0.05
    """m, at no motion."""
    distance_per_metre: float = 0.2
    angle: float = 0.05
    """rad, at no motion."""
    angle_per_radian: float = 0.2
    angle_per_metre: float = 0.1


class Motion(NamedTuple):
    """The numbers of a MotionModel as the kernels take them."""

    distance: float
    distance_per_metre: float
    angle: float
    angle_per_radian: float
    angle_per_metre: float

    @classmethod
    def of(cls, model: MotionModel) -> Motion:
        """Those of a model."""
        return cls(*astuple(model))


@kernel
def sigmas(step: Array, motion: Motion) -> tuple[float, float]:
    """Standard deviations of a step (3,): of its place (m), along as across, and of its turn (rad)."""
    distance = np.hypot(step[0], step[1])
    along = motion.distance + motion.distance_per_metre * distance
    turned = motion.angle_per_radian * abs(step[2]) + motion.angle_per_metre * distance
    return along, motion.angle + turned


def odometry_prior(reference: Array, pose: Array, model: MotionModel) -> Prior:
    """The prior on pose ⊖ reference from the odometry poses (3,) of two scans."""
    step = relative(pose, reference)
    along, about = sigmas(step, Motion.of(model))
    return Prior(step, np.diag([along**-2, along**-2, about**-2]))
