"""How much of what each of n scans sees the others see as well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.joint.scan_set import ScanSet, most_points, scan_grid, scan_points
from nscan_cli.matching.pose_kernels import relative_pose
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


def overlaps(scans: ScanSet, poses: Array) -> Overlaps:
    """The overlaps of n scans at the poses (n, 3)."""
    return Overlaps(*_overlaps(scans, poses))


@kernel
def _overlaps(scans: ScanSet, poses: Array) -> tuple[Array, Array]:
    n = poses.shape[0]
    pairs, shares = np.zeros((n, n)), np.zeros(n)
    _count(scans, poses, np.empty(3), np.empty(most_points(scans), dtype=np.bool_), pairs, shares)
    return pairs, shares


@leaf_kernel
def _count(
    scans: ScanSet, poses: Array, u: Array, seen: NDArray[np.bool_], pairs: Array, shares: Array
) -> None:
    """Write both shares; `u` (3,) and `seen`, of the points of any scan, are room."""
    n = poses.shape[0]
    for j in range(n):
        seen[:] = False
        for i in range(n):
            if i != j:
                pairs[i, j] = _share(scans, poses, i, j, u, seen)
        shares[j] = seen.sum() / max(scan_points(scans, j).shape[0], 1)


@kernel
def held_together(pairs: Array, least: float, scan: int) -> NDArray[np.bool_]:
    """(n,) the scans that hang together with `scan` by overlaps (n, n) of at least `least` either way."""
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
def hold(scans: ScanSet, poses: Array, least: float, scan: int) -> tuple[NDArray[np.bool_], float]:
    """What held_together says of the overlaps at the poses (n, 3), and their weakest link."""
    pairs, _ = _overlaps(scans, poses)
    return held_together(pairs, least, scan), weakest_link(pairs)


@kernel
def held_at(scans: ScanSet, poses: Array, least: float, scan: int) -> NDArray[np.bool_]:
    """What held_together says of the overlaps at the poses (n, 3), of which only those needed are counted."""
    n = poses.shape[0]
    reached = np.zeros(n, dtype=np.bool_)
    waiting, u, seen = np.empty(n, dtype=np.int64), np.empty(3), np.empty(most_points(scans), dtype=np.bool_)
    reached[scan], waiting[0], count = True, scan, 1
    while count > 0:
        count -= 1
        i = waiting[count]
        for j in range(n):
            if not reached[j] and (
                _share(scans, poses, i, j, u, seen) >= least or _share(scans, poses, j, i, u, seen) >= least
            ):
                reached[j], waiting[count] = True, j
                count += 1
    return reached


@leaf_kernel
def _share(scans: ScanSet, poses: Array, i: int, j: int, u: Array, seen: NDArray[np.bool_]) -> float:
    """The share of scan j's points on Gaussians of scan i, which are marked; `u` (3,) is room."""
    points = scan_points(scans, j)
    relative_pose(poses[j], poses[i], u)
    count = find_inliers(scan_grid(scans, i), scans.half, points, u, INLIER_BOUND, seen)
    return float(count / max(points.shape[0], 1))


@kernel
def weakest_link(pairs: Array) -> float:
    """The least overlap on the tree of greatest overlaps (n, n) that connects all scans, 0 for one scan."""
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
