"""The way that a robot drives by odometry, in its own frame: mostly ahead, or always some other way."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array, relative


def driving_direction(poses: Array, min_driven: float, min_steps: int) -> Array:
    """(2,) the mean of the directions of steps along poses (S, 3), nan where unknown; 0 for few steps.

    Its length is 1 if all are the same. Shorter steps than `min_driven` (m) do not count.
    """
    steps = relative(poses[1:], poses[:-1])[:, :2]
    lengths = np.hypot(*steps.T)
    moves = lengths >= min_driven
    if np.count_nonzero(moves) < min_steps:
        return np.zeros(2)
    mean: Array = (steps[moves] / lengths[moves, None]).mean(axis=0)
    return mean
