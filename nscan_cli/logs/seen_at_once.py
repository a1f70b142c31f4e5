"""Scans of a turning laser, converted to what a laser that sees at once would have measured."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Indices, inverse, transform


def seen_at_once(log: LaserLog) -> LaserLog:
    """The log with all ranges from where the laser is at the stamps, as far as `log.path` tells."""
    if log.beam_times is None or log.path is None:
        return log
    ranges = ranges_at_once(log, np.arange(len(log)))
    return replace(log, ranges=ranges, beam_times=None, path=None)


def ranges_at_once(log: LaserLog, rows: Indices) -> NDArray[np.float32]:
    """(N, B) the ranges (m) of the scans in rows (N,) from where the laser is at their stamps.

    Each corrected point goes to the beam that points to it most nearly. A beam without a point has no return
    if it had none, else it is unusable: where the robot turns with its laser, fewer beams are left.
    """
    if log.beam_times is None or log.path is None:
        return log.ranges[rows]
    return np.stack([_ranges(log, row) for row in rows.tolist()])


def _ranges(log: LaserLog, row: int) -> NDArray[np.float32]:
    """The ranges (B,) of one scan, as of ranges_at_once."""
    measured = log.ranges[row]
    found = np.where(np.isinf(measured), np.float32(np.inf), np.float32(np.nan))
    points = transform(inverse(log.mount), log.batch_points(slice(row, row + 1), math.inf)[0])
    step = log.angle_increment[row]
    ahead = (np.arctan2(points[:, 1], points[:, 0]) - log.angle_min[row]) * np.sign(step)
    places = np.mod(ahead + 0.5 * abs(step), 2 * np.pi) / abs(step) - 0.5
    beams = np.rint(places).astype(np.int64)
    inside = beams < log.beam_counts()[row]
    # The nearest is written last.
    order = np.argsort(-np.abs(places - beams), kind="stable")
    order = order[inside[order]]
    found[beams[order]] = np.hypot(points[order, 0], points[order, 1])
    return found
