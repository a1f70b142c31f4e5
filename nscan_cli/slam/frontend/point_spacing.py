"""Step 1: points of a scan that are closer together than needed are left out.

A laser hits a wall beside the robot with hundreds of beams within half a metre, and one a few metres off with
a dozen. So many points in one place outweigh all the rest. The map has them where the robot was, so in a bare
corridor they hold the robot back. A robot that drove backwards 0.2 m beside a wall lost two thirds of its way
with odometry.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, Indices, Mask


@kernel
def spaced_points(points: Array, ends: Indices, spacing: float) -> Mask:
    """(P,) which points (P, 2) are at least `spacing` (m) from the last one kept of their scan, in the order
    of the beams. Scan k has points[ends[k] : ends[k + 1]]."""
    kept = np.zeros(points.shape[0], dtype=np.bool_)
    for k in range(ends.shape[0] - 1):
        last = -1
        for i in range(ends[k], ends[k + 1]):
            if last >= 0:
                x, y = points[i, 0] - points[last, 0], points[i, 1] - points[last, 1]
                if x * x + y * y < spacing * spacing:
                    continue
            kept[i] = True
            last = i
    return kept
