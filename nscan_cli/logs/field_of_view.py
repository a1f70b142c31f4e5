"""The field of view of the scans of a log, and the shares of beams without usable reading."""

from __future__ import annotations

import numpy as np

from nscan_cli.logs.laser_log import LaserLog


def field_of_view(log: LaserLog) -> tuple[float, float, float]:
    """First direction, last direction and step (rad) of the scan with the widest field of view."""
    between = log.beam_counts() - 1
    row = int(np.argmax(np.abs(log.angle_increment) * between))
    first, step = float(log.angle_min[row]), float(log.angle_increment[row])
    return first, first + int(between[row]) * step, step


def beams_lost(log: LaserLog) -> tuple[float, float]:
    """The shares of all beams without return, and of unusable beams."""
    total = int(log.beam_counts().sum())
    missing = log.ranges.size - total
    unusable = np.count_nonzero(np.isnan(log.ranges)) - missing
    return np.count_nonzero(np.isinf(log.ranges)) / total, unusable / total
