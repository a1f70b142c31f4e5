"""What the scans of a log see: their field of view, and the shares of their beams that say nothing."""

from __future__ import annotations

import numpy as np

from nscan_cli.logs.laser_log import LaserLog


def field_of_view(log: LaserLog) -> tuple[float, float, float]:
    """First and last direction and step (rad) of the scan that sees the most with its own beams."""
    between = log.beam_counts() - 1
    row = int(np.argmax(np.abs(log.angle_increment) * between))
    first, step = float(log.angle_min[row]), float(log.angle_increment[row])
    return first, first + int(between[row]) * step, step


def beams_lost(log: LaserLog) -> tuple[float, float]:
    """The shares of all scans' own beams that are without return, and that are unusable."""
    total = int(log.beam_counts().sum())
    missing = log.ranges.size - total
    unusable = np.count_nonzero(np.isnan(log.ranges)) - missing
    return np.count_nonzero(np.isinf(log.ranges)) / total, unusable / total
