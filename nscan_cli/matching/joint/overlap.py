"""Overlap of n scans: the share of each scan's points that lie on Gaussians of others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.joint.scan_set import ScanSet, most_points, scan_grid, scan_points
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.ndt.energy import find_inliers
from nscan_cli.poses import Array, Mask


class Overlaps(NamedTuple):
    """Shares of the points of n scans that lie on Gaussians."""

    pairs: Array
    """(n, n) at [i, j] the share of scan j's points that lie on Gaussians of scan i; 0 on the diagonal."""
    scans: Array
    """(n,) the share of each scan's points that lie on Gaussians of at least one other scan."""


@kernel
def overlaps(scans: ScanSet, poses: Array, inlier_bound: float) -> Overlaps:
    """The overlaps of n scans at the poses (n, 3).

    A point lies on a Gaussian within a squared Mahalanobis distance of `inlier_bound`.
    """
    n = poses.shape[0]
    pairs, shares, u = np.zeros((n, n)), np.zeros(n), np.empty(3)
    inliers = np.empty(most_points(scans), dtype=np.bool_)
    for j in range(n):
        inliers[:] = False
        for i in range(n):
            if i != j:
                pairs[i, j] = _pair_overlap(scans, poses, i, j, inlier_bound, u, inliers)
        shares[j] = inliers.sum() / max(scan_points(scans, j).shape[0], 1)
    return Overlaps(pairs, shares)


@kernel
def connectivity(
    scans: ScanSet, poses: Array, inlier_bound: float, least: float, scan: int
) -> tuple[Mask, float]:
    """The scans (n,) that are connected to `scan` as in `connected_at`, and the weakest link of all."""
    pairs = overlaps(scans, poses, inlier_bound).pairs
    return _connected(scans, poses, inlier_bound, least, scan, pairs), weakest_link(pairs)


@kernel
def connected_at(scans: ScanSet, poses: Array, inlier_bound: float, least: float, scan: int) -> Mask:
    """(n,) the scans connected to `scan` by overlaps of at least `least`, either way, at the poses (n, 3)."""
    # Only the overlaps that are needed are counted.
    unknown = np.full((poses.shape[0], poses.shape[0]), np.nan)
    return _connected(scans, poses, inlier_bound, least, scan, unknown)


@kernel
def _connected(
    scans: ScanSet, poses: Array, inlier_bound: float, least: float, scan: int, pairs: Array
) -> Mask:
    """As `connected_at`; `pairs` (n, n) are overlaps as far as they are known, else nan."""
    n = poses.shape[0]
    reached = np.zeros(n, dtype=np.bool_)
    waiting, u = np.empty(n, dtype=np.int64), np.empty(3)
    inliers = np.empty(most_points(scans), dtype=np.bool_)
    reached[scan], waiting[0], count = True, scan, 1
    while count > 0:
        count -= 1
        i = waiting[count]
        for j in range(n):
            for a, b in ((i, j), (j, i)):
                if not reached[j] and np.isnan(pairs[a, b]):
                    pairs[a, b] = _pair_overlap(scans, poses, a, b, inlier_bound, u, inliers)
                if not reached[j] and pairs[a, b] >= least:
                    reached[j], waiting[count] = True, j
                    count += 1
    return reached


@leaf_kernel
def _pair_overlap(
    scans: ScanSet, poses: Array, i: int, j: int, inlier_bound: float, u: Array, inliers: Mask
) -> float:
    """The share of scan j's points on Gaussians of scan i; marks them in `inliers`. `u` (3,) is a buffer."""
    points = scan_points(scans, j)
    relative_pose(poses[j], poses[i], u)
    count = find_inliers(scan_grid(scans, i), scans.half, points, u, inlier_bound, inliers)
    return float(count / max(points.shape[0], 1))


@kernel
def weakest_link(pairs: Array) -> float:
    """The least overlap on the maximum spanning tree of overlaps (n, n); 0 for one scan."""
    n = pairs.shape[0]
    reached, best = np.zeros(n, dtype=np.bool_), np.zeros(n)
    weakest, last = np.inf, 0
    for _ in range(n - 1):
        reached[last] = True
        following = -1
        for j in range(n):
            best[j] = max(best[j], pairs[last, j], pairs[j, last])
            if not reached[j] and (following < 0 or best[j] > best[following]):
                following = j
        weakest, last = min(weakest, best[following]), following
    return weakest if n > 1 else 0.0
