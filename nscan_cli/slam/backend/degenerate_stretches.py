"""Where no scan tells how far the robot went: along bare walls without odometry.

Tracking keeps such scans to steady motion. If the robot went faster or slower meanwhile, the way is too long
or too short, every match fits, and nothing contradicts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array, Mask, path_lengths
from nscan_cli.slam.backend.options import DegenerateStretchOptions
from nscan_cli.slam.frontend.odometry_checks import SHORTEST_PERIOD


class DegenerateStretch(NamedTuple):
    """A stretch of the path."""

    first: int
    """Row of its first scan."""
    last: int
    """Row of its last scan."""
    path: float
    """Length of the stretch as mapped, m."""
    possible: float
    """Length of the stretch at the robot's usual speed, m: it may only seem to stand."""

    def is_long(self, options: DegenerateStretchOptions) -> bool:
        """Whether it is long as mapped."""
        return self.path >= options.path


def degenerate_stretches(
    poses: Array, times: Array, weakest_sigmas: Array, options: DegenerateStretchOptions
) -> list[DegenerateStretch]:
    """The stretches of `options.path` or more, as mapped or at the robot's usual speed.

    The scans are at poses (S, 3) and times (S,), s, and tell their places to `weakest_sigmas` (S,), m.
    """
    rows = np.flatnonzero(weakest_sigmas > options.sigma)
    if not len(rows):
        return []
    along = path_lengths(poses)
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > options.scans_between + 1) + 1)
    speed, ways = _usual_speed(poses, times, weakest_sigmas <= options.sigma, options), []
    for piece in pieces:
        begin, last = max(int(piece[0]) - 1, 0), int(piece[-1])
        possible = speed * float(times[last] - times[begin])
        way = DegenerateStretch(int(piece[0]), last, float(along[last] - along[begin]), possible)
        if max(way.path, way.possible) >= options.path:
            ways.append(way)
    return ways


def _usual_speed(poses: Array, times: Array, is_told: Mask, options: DegenerateStretchOptions) -> float:
    """The median speed (m/s) along a path (S, 3) of a robot that moves, where scans or odometry tell it."""
    speeds = np.hypot(*np.diff(poses[:, :2], axis=0).T) / np.maximum(np.diff(times), SHORTEST_PERIOD)
    moves = speeds > options.least_speed
    told = moves & is_told[1:]
    chosen = told if told.any() else moves
    return float(np.median(speeds[chosen])) if chosen.any() else 0.0
