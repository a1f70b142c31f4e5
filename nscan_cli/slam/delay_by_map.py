"""How late the odometry is, by the turns of a finished map.

The check of the file measures a few steps before the drive is mapped (calibration/odometry_delay.py). Where a
robot seldom turns, or scans tell single turns badly, these may tell no delay. A map tells all turns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.calibration.odometry_delay import delay_by_turns
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.turn_differences import Turns
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array


def delay_by_map(log: LaserLog, poses: Array, breaks: Sequence[int], options: FileCheckOptions) -> float:
    """Seconds to add to the stamps of odometry, so that its turns fit those of a map; 0 in doubt.

    The map has the scans at poses (S, 3). No turn leads over the rows `breaks`, at which tracking broke.
    """
    if log.odometry is None:
        return 0.0
    return delay_by_turns(log, turns_of_map(log.times, poses, breaks, options), options.lag)


def turns_of_map(times: Array, poses: Array, breaks: Sequence[int], options: FileCheckOptions) -> Turns:
    """The turns of poses (S, 3) at times (S,), s: one after another, each of about the least that counts."""
    headings = np.unwrap(poses[:, 2])
    turned = np.append(0.0, np.cumsum(np.abs(np.diff(headings))))
    ends = np.flatnonzero(np.diff(np.floor(turned / options.lag.map_turn), prepend=-1.0) > 0.0)
    first, last = ends[:-1], ends[1:]
    segments = np.searchsorted(np.asarray(breaks), ends, side="right")
    kept = (times[last] - times[first] <= options.steps.max_duration) & (np.diff(segments) == 0)
    first, last = first[kept], last[kept]
    return Turns(times[first], times[last], headings[last] - headings[first])
