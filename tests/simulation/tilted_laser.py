"""A laser that is tilted, so that the floor hides what is behind it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array


def tilted(
    log: LaserLog, distance: float, bearing: float = 0.0, rocking: float = 0.0, noise: float = 0.02
) -> LaserLog:
    """The laser sees the floor at a distance (m) in a bearing of its frame (rad), and farther away aside.

    The robot rocks, so that the distance varies by a share of it; noise is a share of a range, too.
    """
    beams = log.angle_min[:, None] + log.angle_increment[:, None] * np.arange(log.ranges.shape[1])
    ahead: Array = np.cos(beams - bearing)
    at = distance * (1.0 + rocking * np.sin(np.arange(len(log)) / 7.0))[:, None]
    floor = np.where(ahead > np.cos(np.radians(80.0)), at / np.maximum(ahead, 0.1), np.inf)
    floor *= 1.0 + noise * np.random.default_rng(1).standard_normal(beams.shape)
    return replace(log, ranges=np.minimum(log.ranges, floor).astype(np.float32))
