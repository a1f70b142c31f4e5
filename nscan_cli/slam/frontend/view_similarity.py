"""Whether two scans see the same: in how many bearings the nearest thing is equally far."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array

BEARINGS = 180
"""Into so many parts the view is divided."""
LEAST_BEARINGS = 10
"""In so many both must meet something, to be compared."""


def view_similarity(points: Array, others: Array, apart: float, apart_per_metre: float) -> float | None:
    """Share of bearings in which two scans meet the nearest thing at the same range; None: too few to tell.

    Points (m, 2) and (n, 2) in the frame of one of the robot's poses; only bearings in which both meet
    something count. The same is what is no further `apart` (m), and by so much more for each metre of range.
    """
    one, other = np.empty((2, BEARINGS))
    nearest_ranges(points, np.zeros(3), one)
    nearest_ranges(others, np.zeros(3), other)
    share = share_alike(one, other, apart, apart_per_metre)
    return None if np.isnan(share) else float(share)


@kernel
def nearest_ranges(points: Array, pose: Array, ranges: Array) -> None:
    """Write the range of the nearest point in each part of the view (BEARINGS,), inf where there is none.

    The points (m, 2) are seen from where their frame is at a `pose` (3,).
    """
    ranges[:] = np.inf
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(points.shape[0]):
        x = cos * points[k, 0] - sin * points[k, 1] + pose[0]
        y = sin * points[k, 0] + cos * points[k, 1] + pose[1]
        part = int((np.arctan2(y, x) + np.pi) / (2 * np.pi) * BEARINGS) % BEARINGS
        ranges[part] = min(ranges[part], np.hypot(x, y))


@kernel
def share_alike(one: Array, other: Array, apart: float, apart_per_metre: float) -> float:
    """The share of bearings in which two views (BEARINGS,) are the same; nan: too few to tell."""
    both = same = 0
    for k in range(len(one)):
        if np.isfinite(one[k]) and np.isfinite(other[k]):
            both += 1
            same += abs(one[k] - other[k]) < apart + apart_per_metre * min(one[k], other[k])
    return same / both if both >= LEAST_BEARINGS else np.nan
