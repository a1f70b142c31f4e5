"""Where no scan tells how far the robot went: along bare walls without odometry.

Tracking keeps such scans to steady motion. If the robot went faster or slower meanwhile, the way is too long
or too short, every match fits, and nothing contradicts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array
from nscan_cli.slam.diagnostics.options import UntoldWayOptions


class UntoldWay(NamedTuple):
    """A stretch of the path."""

    first: int
    """Row of its first scan."""
    last: int
    """Row of its last scan."""
    path: float
    """Its length as mapped, m."""


def untold_ways(poses: Array, told_sigmas: Array, options: UntoldWayOptions) -> list[UntoldWay]:
    """The stretches among scans at poses (S, 3) that tell their places to `told_sigmas` (S,) in m."""
    rows = np.flatnonzero(told_sigmas > options.sigma)
    if not len(rows):
        return []
    steps = np.append(0.0, np.hypot(*np.diff(poses[:, :2], axis=0).T))
    along = np.cumsum(steps)
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > options.scans_between + 1) + 1)
    ways = [UntoldWay(int(p[0]), int(p[-1]), float(along[p[-1]] - along[max(p[0] - 1, 0)])) for p in pieces]
    return [way for way in ways if way.path >= options.path]
