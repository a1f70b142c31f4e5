"""Whether two scans see the same: the share of sectors in which their nearest points are equally far."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.break_options import ViewSimilarityOptions


def view_similarity(points: Array, others: Array, options: ViewSimilarityOptions) -> float | None:
    """The share of sectors in which two scans have the same range; None where too few can be compared.

    The points (m, 2) and (n, 2) are in one frame, that of one of the robot's poses.
    """
    one, other = np.empty((2, options.sectors))
    nearest_ranges(points, np.zeros(3), one)
    nearest_ranges(others, np.zeros(3), other)
    share = share_alike(one, other, options)
    return None if np.isnan(share) else float(share)


@kernel
def nearest_ranges(points: Array, pose: Array, ranges: Array) -> None:
    """Write the range of the nearest point in each sector (n,), inf where there is none.

    The points (m, 2) are moved by `pose` (3,) and seen from the origin.
    """
    ranges[:], sectors = np.inf, len(ranges)
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(points.shape[0]):
        x = cos * points[k, 0] - sin * points[k, 1] + pose[0]
        y = sin * points[k, 0] + cos * points[k, 1] + pose[1]
        sector = int((np.arctan2(y, x) + np.pi) / (2 * np.pi) * sectors) % sectors
        ranges[sector] = min(ranges[sector], np.hypot(x, y))


@kernel
def share_alike(one: Array, other: Array, options: ViewSimilarityOptions) -> float:
    """The share of sectors in which two views (n,) have the same range; nan where too few can be compared."""
    both = same = 0
    for k in range(len(one)):
        if np.isfinite(one[k]) and np.isfinite(other[k]):
            both += 1
            tolerance = options.tolerance + options.tolerance_per_metre * min(one[k], other[k])
            same += abs(one[k] - other[k]) < tolerance
    return same / both if both >= options.min_sectors else np.nan
