"""Step 1: points of a scan that are closer together than needed are left out; wide gaps may be bridged.

A laser hits a wall beside the robot with hundreds of beams within half a metre, and one a few metres off with
a dozen. So many points in one place outweigh all the rest. The map has them where the robot was, so in a bare
corridor they hold the robot back. A robot that drove backwards 0.2 m beside a wall lost two thirds of its way
with odometry.
"""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.poses import Array, Indices, Mask


@kernel
def spaced_points(points: Array, ends: Indices, spacing: float, neighbours: int) -> Mask:
    """(P,) which points (P, 2) are kept, so that those kept are about `spacing` (m) apart along their scan.

    Scan k has points[ends[k] : ends[k + 1]], in the order of the beams. The distance from a point to the next
    one is measured between its neighbours on both sides, so many (`neighbours`). Its own noise must not
    decide whether it is kept. If the first point that is far enough from the last one were kept, points ahead
    would lie too far on, and a straight corridor would be mapped as a bend.
    """
    kept = np.zeros(points.shape[0], dtype=np.bool_)
    for k in range(ends.shape[0] - 1):
        first, last, way = ends[k], ends[k + 1] - 1, 0.5
        for i in range(first, last + 1):
            low, high = max(first, i - neighbours), min(last, i + neighbours)
            x, y = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
            reached = spacing * (high - low)
            way += 1.0 if x * x + y * y >= reached * reached else math.sqrt(x * x + y * y) / reached
            if way >= 1.0:
                way -= 1.0
                kept[i] = True
    return kept


def points_between(points: Array, options: GaussianOptions, longest: float) -> Array:
    """Points (n, 2) on the lines between neighbouring points (m, 2) of a scan, at most `longest` (m) apart.

    They are so close that a wall that crosses a cell has enough of them for a Gaussian.
    """
    steps = np.diff(points, axis=0)
    gaps = np.hypot(steps[:, 0], steps[:, 1])
    spacing = options.cell / (options.minimum + 1)
    counts = np.where(gaps <= longest, np.ceil(gaps / spacing) - 1, 0).clip(0).astype(np.int64)
    before = np.repeat(np.arange(len(counts)), counts)
    number = 1 + np.arange(len(before)) - np.repeat(np.cumsum(counts) - counts, counts)
    return points[before] + (number / (counts[before] + 1))[:, None] * steps[before]
