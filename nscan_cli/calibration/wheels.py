"""The two wheels of a differential drive, from the scale of its lengths, the ratio of its turns and its veer.

Odometry counts r and l metres of the right and the left wheel, drives (r + l) / 2 by them and turns by
(r − l) / b₀. Wheels that in truth come k_r r and k_l l on a track of width b drive k = (k_r + k_l) / 2 times
as far, and turn by (k_r r − k_l l) / b. So a robot that goes straight by odometry turns by (k_r − k_l) / b
per metre. Scans tell b / b₀ and (k_r − k_l) / (k b). What b itself changes is the length of steps that turn,
as a laser does that is mounted beside the middle of the robot: it stays open.
A. Censi, A. Franchi, L. Marchionni, G. Oriolo, "Simultaneous Calibration of Odometry and Sensor Parameters
for Mobile Robots", T-RO 2013.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.estimate import Estimate, left_open
from nscan_cli.poses import Array

IS_SIDEWAYS = "odometry goes sideways: it is not of two wheels"


def wheels(
    scale: Estimate, ratio: Estimate, veer: Estimate, sideways: float, max_sideways: float
) -> dict[str, Estimate]:
    """wheel_difference (1/m): by how much the right wheel is larger than the left, as a share, per metre of
    track width; track_width: as a multiple of what odometry takes it for.

    `ratio` are turns by odometry as a multiple of those by scans, `veer` is the heading (rad) that odometry
    gains per metre, `sideways` the median share of a step by odometry to its side.
    """
    unknown = next((each.why_open for each in (scale, ratio, veer) if each.is_open), "")
    if sideways > max_sideways:
        unknown = IS_SIDEWAYS
    if unknown:
        return {"wheel_difference": left_open(0.0, 0.0, unknown), "track_width": left_open(1.0, 1.0, unknown)}
    difference, width = -veer.value / ratio.value, scale.value * ratio.value
    by_ratio = ratio.sigma / ratio.value
    return {
        "wheel_difference": Estimate(
            difference, float(np.hypot(veer.sigma / ratio.value, difference * by_ratio)), 0.0
        ),
        "track_width": Estimate(width, float(width * np.hypot(scale.sigma / scale.value, by_ratio)), 1.0),
    }


def sideways_share(steps: Array) -> float:
    """The median share of steps (n, 3) to the side of the heading half-way, in which an arc goes."""
    half_way = np.arctan2(steps[:, 1], steps[:, 0]) - 0.5 * steps[:, 2]
    return float(np.median(np.abs(np.sin(half_way))))
