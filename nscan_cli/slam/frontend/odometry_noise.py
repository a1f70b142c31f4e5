"""Step 1 with odometry: how good the odometry of this robot is, learned during tracking.

Odometry differs from robot to robot by a factor of ten. Over each piece of the path along which all scans
tell their place, the distance by scans is compared with that by odometry, without its bias. The difference
has the noise of both, so it is an upper bound on that of odometry. A prior as narrow as this bound keeps good
odometry where scans tell little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.array_assignment import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.matching.small_matrices import information_of_place
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.odometry_bias import (
    OdometryBias,
    OdometryBiasOptions,
    learn_bias,
    take_out_bias,
)

SAMPLES, PIECE_LENGTH, TELLING = 0, 1, 2
"""Places in `OdometryNoise.counts`: the pieces of the path that were compared, the length (m) of the present
one, and whether all its scans told their place."""


class OdometryNoiseOptions(NamedTuple):
    """How the noise of the odometry is learned."""

    window: float = 4.0
    """Length of the pieces of the path, m. With longer ones wrong scales weigh more against chance."""
    smoothing: float = 0.1
    """Least weight of a new piece in the mean square. A larger weight follows changes faster."""
    min_pieces: int = 4
    """Nothing is learned from fewer pieces. A larger number learns later."""
    factor: float = 2.0
    """A prior has the standard deviation learned times this. A larger factor trusts the odometry less."""
    turn_arm: float = 1.0
    """A turn by one radian counts as this length of way, m. A longer one widens the prior of turns."""
    min_share: float = 0.1
    """Least share of the standard deviation of `trusted_odometry` that a prior keeps. A larger share trusts
    good odometry less."""
    bias: OdometryBiasOptions = OdometryBiasOptions()
    """When what is the same in all pieces is taken out."""


class OdometryNoise(NamedTuple):
    """What is learned, which the kernels change."""

    pose: Array
    """(3,) pose where the present piece of the path begins."""
    odometry: Array
    """(3,) the odometry there; nan before the first piece."""
    variances: Array
    """(2,) mean square difference of both ways: of a coordinate, m² a metre; of the angle, rad² a metre."""
    counts: Array
    """(3,) SAMPLES, PIECE_LENGTH and TELLING."""
    bias: OdometryBias
    """What is the same in all pieces."""

    @classmethod
    def begin(cls) -> OdometryNoise:
        """Nothing is known."""
        return cls(np.zeros(3), np.full(3, np.nan), np.zeros(2), np.zeros(3), OdometryBias.begin())


@kernel
def learn_noise(
    noise: OdometryNoise,
    options: OdometryNoiseOptions,
    pose: Array,
    odometry: Array,
    length: float,
    hessian: Array,
    least_information: float,
) -> None:
    """Take in a matched scan: its pose (3,), odometry (3,), and the `length` (m) of the step to it,
    nan without odometry.

    It tells its place if its Hessian (3, 3), without the prior, has at least this information (1/m²) in each
    direction.
    """
    counts, way, by_odometry = noise.counts, np.empty(3), np.empty(3)
    if not np.isfinite(length):
        noise.odometry[0] = np.nan
    counts[PIECE_LENGTH] += length
    if _weakest_information(hessian) < least_information:
        counts[TELLING] = 0.0
    if np.isfinite(noise.odometry[0]) and counts[PIECE_LENGTH] < options.window:
        return
    if np.isfinite(noise.odometry[0]) and counts[TELLING] > 0.0:
        relative_pose(pose, noise.pose, way)
        relative_pose(odometry, noise.odometry, by_odometry)
        learn_bias(noise.bias, options.bias, way, by_odometry, counts[PIECE_LENGTH])
        take_out_bias(noise.bias, options.bias, by_odometry, counts[PIECE_LENGTH])
        off, turned = way - by_odometry, wrapped(way[2] - by_odometry[2])
        counts[SAMPLES] += 1.0
        weight = max(1.0 / counts[SAMPLES], options.smoothing)
        square = 0.5 * (off[0] * off[0] + off[1] * off[1])
        noise.variances[0] += weight * (square / counts[PIECE_LENGTH] - noise.variances[0])
        noise.variances[1] += weight * (turned * turned / counts[PIECE_LENGTH] - noise.variances[1])
    assign(noise.pose, pose)
    assign(noise.odometry, odometry)
    counts[PIECE_LENGTH], counts[TELLING] = 0.0, 1.0


@kernel
def learned_shares(
    noise: OdometryNoise, options: OdometryNoiseOptions, length: float, along: float, about: float
) -> tuple[float, float]:
    """The factors by which the deviations `along` (m) and `about` (rad) of a step of this length (m)
    shrink."""
    if noise.counts[SAMPLES] < options.min_pieces:
        return 1.0, 1.0
    distance = options.factor * np.sqrt(noise.variances[0] * length) / along
    angle = options.factor * np.sqrt(noise.variances[1] * length) / about
    return min(max(distance, options.min_share), 1.0), min(max(angle, options.min_share), 1.0)


@kernel
def _weakest_information(hessian: Array) -> float:
    """The information (1/m²) of a Hessian (3, 3) in its weakest direction, its angle free."""
    xx, xy, yy = information_of_place(hessian)
    return float(0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy))
