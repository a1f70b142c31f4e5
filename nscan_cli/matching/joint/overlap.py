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
    """Shares of points that lie on Gaussians."""

    pairs: Array
    """(n, n) [i, j]: of scan j's points, on those of scan i; 0 on the diagonal."""
    scans: Array
    """(n,) of each scan's points, on those of at least one other scan."""


@kernel
def overlaps(scans: ScanSet, poses: Array, inlier_bound: float) -> Overlaps:
    """The overlaps of n scans at the poses (n, 3), of points within a Mahalanobis distance² of the bound."""
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
def connected_to(pairs: Array, least: float, scan: int) -> Mask:
    """(n,) the scans that are connected to `scan` by overlaps (n, n) of at least `least`, either way."""
    n = pairs.shape[0]
    reached = np.zeros(n, dtype=np.bool_)
    waiting = np.empty(n, dtype=np.int64)
    reached[scan], waiting[0], count = True, scan, 1
    while count > 0:
        count -= 1
        i = waiting[count]
        for j in range(n):
            if not reached[j] and max(pairs[i, j], pairs[j, i]) >= least:
                reached[j], waiting[count] = True, j
                count += 1
    return reached


@kernel
def connectivity(
    scans: ScanSet, poses: Array, inlier_bound: float, least: float, scan: int
) -> tuple[Mask, float]:
    """The scans (n,) connected to `scan` by overlap at the poses (n, 3), and the weakest link of all."""
    pairs = overlaps(scans, poses, inlier_bound).pairs
    return connected_to(pairs, least, scan), weakest_link(pairs)


@kernel
def connected_at(scans: ScanSet, poses: Array, inlier_bound: float, least: float, scan: int) -> Mask:
    """As `connected_to` at the poses (n, 3), where only the overlaps that are needed are counted."""
    n = poses.shape[0]
    reached = np.zeros(n, dtype=np.bool_)
    waiting, u = np.empty(n, dtype=np.int64), np.empty(3)
    inliers = np.empty(most_points(scans), dtype=np.bool_)
    reached[scan], waiting[0], count = True, scan, 1
    while count > 0:
        count -= 1
        i = waiting[count]
        for j in range(n):
            if not reached[j] and (
                _pair_overlap(scans, poses, i, j, inlier_bound, u, inliers) >= least
                or _pair_overlap(scans, poses, j, i, inlier_bound, u, inliers) >= least
            ):
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
