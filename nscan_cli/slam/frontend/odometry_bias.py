"""Step 1 with odometry: what is wrong with it everywhere alike, learned during tracking.

Wheels of another size than the file says make all ways too long or too short; wheels of different sizes make
all ways bend. Scans show both. Where they tell little, odometry without its bias leads on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.poses import Array

LENGTH_BIAS, TURN_BIAS = 0, 1
"""Places in the arrays of `OdometryBias`."""


class OdometryBiasOptions(NamedTuple):
    """When the bias of the odometry is taken out."""

    min_straightness: float = 0.5
    """Least distance between both ends of a piece, as a share of its length. A larger share leaves out more
    pieces with turns."""
    min_pieces: int = 8
    """Nothing is taken out before this number of pieces of the path. A larger number takes it out later."""
    smoothing: float = 0.1
    """Least weight of a new piece in the mean. A larger weight follows changes faster."""
    sigmas: float = 8.0
    """A bias is certain if it exceeds this number of its standard deviations. A larger number takes it out
    later."""
    min_length: float = 0.05
    """Least share by which ways are too long or too short. A larger share leaves odometry as it is."""
    min_turn: float = 0.03
    """Least turn along straight ways, rad/m. A larger one leaves odometry as it is."""


class OdometryBias(NamedTuple):
    """What is learned, which the kernels change: LENGTH_BIAS, a share of the length by odometry, and
    TURN_BIAS, rad a metre."""

    means: Array
    """(2,) by how much the robot goes farther, and turns more, than by odometry."""
    variances: Array
    """(2,) mean square deviation of the pieces from that."""
    pieces: Array
    """(1,) number of pieces of the path that were compared."""

    @classmethod
    def begin(cls) -> OdometryBias:
        """Nothing is known."""
        return cls(np.zeros(2), np.zeros(2), np.zeros(1))


@kernel
def learn_bias(
    bias: OdometryBias, options: OdometryBiasOptions, way: Array, by_odometry: Array, length: float
) -> None:
    """Take in a piece of the path of this length (m): the way (3,) by scans, and that by odometry.

    Pieces on which the robot turned around are left out: their ends tell no length.
    """
    distance = np.hypot(by_odometry[0], by_odometry[1])
    if distance < options.min_straightness * length:
        return
    bias.pieces[0] += 1.0
    weight = max(1.0 / bias.pieces[0], options.smoothing)
    longer = np.hypot(way[0], way[1]) / distance - 1.0
    turned = wrapped(way[2] - by_odometry[2]) / length
    for which in range(2):
        off = (longer if which == LENGTH_BIAS else turned) - bias.means[which]
        bias.means[which] += weight * off
        bias.variances[which] += weight * ((1.0 - weight) * off * off - bias.variances[which])


@kernel
def take_out_bias(bias: OdometryBias, options: OdometryBiasOptions, step: Array, length: float) -> None:
    """Take what is certain of the bias out of a step (3,) by odometry, over a way of this length (m)."""
    factor = 1.0 + _certain(bias, options, LENGTH_BIAS, options.min_length)
    turned = _certain(bias, options, TURN_BIAS, options.min_turn) * length
    # Over an arc, the chord turns by half as much.
    cos, sin = factor * np.cos(0.5 * turned), factor * np.sin(0.5 * turned)
    x, y = step[0], step[1]
    step[0], step[1], step[2] = cos * x - sin * y, sin * x + cos * y, wrapped(step[2] + turned)


@kernel
def _certain(bias: OdometryBias, options: OdometryBiasOptions, which: int, least: float) -> float:
    """A mean bias; 0 while it is too small or not certain."""
    mean, pieces = bias.means[which], bias.pieces[0]
    if pieces < options.min_pieces or abs(mean) < least:
        return 0.0
    # The variance of a mean over the last pieces, whose weights fall by `smoothing` from one to the next.
    variance = bias.variances[which] * max(1.0 / pieces, options.smoothing / (2.0 - options.smoothing))
    return float(mean) if mean * mean > options.sigmas * options.sigmas * variance else 0.0
