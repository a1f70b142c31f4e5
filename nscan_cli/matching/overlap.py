"""How much of what each of n scans sees the others see as well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.compiled import lean_kernel
from nscan_cli.matching.planar import relative_pose
from nscan_cli.matching.scans import Scans, scan_grid, scan_points
from nscan_cli.ndt.energy import find_inliers
from nscan_cli.poses import Array

INLIER_BOUND = 9.0
"""A point within this squared Mahalanobis distance of a Gaussian lies on it."""
LEAST_OVERLAP = 0.1
"""With a smaller share of its points on another scan, a scan does not overlap it."""

SOUND_OVERLAP = 0.5
"""Scans that lie where they belong hang together by so much of what they see, mostly."""


class Overlaps(NamedTuple):
    """Shares of points that lie on Gaussians."""

    pairs: Array
    """(n, n) [i, j]: of scan j's points, on those of scan i; 0 on the diagonal."""
    scans: Array
    """(n,) of each scan's points, on those of at least one other scan."""


def overlaps(scans: Scans, poses: Array) -> Overlaps:
    """The overlaps of n scans at the poses (n, 3)."""
    n = len(poses)
    shares = Overlaps(np.zeros((n, n)), np.zeros(n))
    seen = np.empty(np.diff(scans.point_starts).max(initial=0), dtype=np.bool_)
    _count(scans, poses, np.empty(3), seen, shares.pairs, shares.scans)
    return shares


@lean_kernel
def _count(
    scans: Scans, poses: Array, u: Array, seen: NDArray[np.bool_], pairs: Array, shares: Array
) -> None:
    """Write both shares; `u` (3,) and `seen`, of the points of any scan, are room."""
    n = poses.shape[0]
    for j in range(n):
        points = scan_points(scans, j)
        seen[:] = False
        weight = 1.0 / max(points.shape[0], 1)
        for i in range(n):
            if i == j:
                continue
            relative_pose(poses[j], poses[i], u)
            pairs[i, j] = weight * find_inliers(
                scan_grid(scans, i), scans.half, points, u, INLIER_BOUND, seen
            )
        shares[j] = weight * seen.sum()


def held_together(pairs: Array, least: float, scan: int) -> NDArray[np.bool_]:
    """(n,) the scans that hang together with `scan` by overlaps (n, n) of at least `least` either way."""
    linked = np.maximum(pairs, pairs.T) >= least
    reached = np.zeros(len(pairs), dtype=bool)
    reached[scan] = True
    while True:
        further = reached | linked[reached].any(axis=0)
        if (further == reached).all():
            return reached
        reached = further


def weakest_link(pairs: Array) -> float:
    """The least overlap on the tree of greatest overlaps (n, n) that connects all scans, 0 for one scan."""
    links = np.maximum(pairs, pairs.T)
    best, weakest = links[0].copy(), np.inf
    reached = np.arange(len(links)) == 0
    for _ in range(len(links) - 1):
        following = int(np.argmax(np.where(reached, -1.0, best)))
        weakest = min(weakest, float(best[following]))
        reached[following] = True
        best = np.maximum(best, links[following])
    return weakest if len(links) > 1 else 0.0
