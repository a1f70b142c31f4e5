"""What is known of a relative pose before matching: the odometry as a prior (paper, III-E, eq. (14))."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

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


def odometry_prior(reference: Array, pose: Array, model: MotionModel) -> Prior:
    """The prior on pose ⊖ reference from the odometry poses (3,) of two scans."""
    step = relative(pose, reference)
    x, y, turn = step.tolist()
    distance = math.hypot(x, y)
    sigma = model.distance + model.distance_per_metre * distance
    sigma_angle = model.angle + model.angle_per_radian * abs(turn) + model.angle_per_metre * distance
    along, about = sigma**-2, sigma_angle**-2
    return Prior(step, np.array([[along, 0.0, 0.0], [0.0, along, 0.0], [0.0, 0.0, about]]))
