"""Scans as they are matched with each other: some of their beams, seen from the laser."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices


class ThinnedScan(NamedTuple):
    """m usable beams of a scan, evenly spread among these."""

    points: Array
    """(m, 2) their end points in the frame of the laser, as if it saw all at once, m."""
    beams: Indices
    """(m,) their places in the scan."""


def thinned_scan(log: LaserLog, row: int, options: StepOptions) -> ThinnedScan | None:
    """The scan in a row of a log; None if it has too few usable beams for one Gaussian."""
    ranges, pair = log.ranges[row], options.pair
    (beams,) = (ranges <= pair.reach).nonzero()
    if len(beams) < pair.minimum:
        return None
    # Outdoors most beams may not return; the others are too few for a match if they are thinned as well.
    beams = beams[:: max(min(len(ranges) // options.max_beams, -(-len(beams) // options.max_beams)), 1)]
    lengths = ranges[beams].astype(np.float64)
    directions = log.angle_min[row] + log.angle_increment[row] * beams
    points = np.empty((len(beams), 2))
    points[:, 0], points[:, 1] = lengths * np.cos(directions), lengths * np.sin(directions)
    return ThinnedScan(points, beams)
