"""The index set J: which pairs of scans are matched with each other (paper, III-B; V leaves open how).

It contains a pair in both orders, since each scan is matched with the Gaussians of the other.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.joint.joint_energy import all_pairs
from nscan_cli.matching.joint.options import IndexSetOptions
from nscan_cli.matching.joint.scan_set import ScanSet, scan_grid, scan_points
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.ndt.hash_grid import facing_gaussian, find_row, pack_key
from nscan_cli.poses import Array, Indices, Mask

IndexSetKind = Literal["all", "visible", "overlap"]
"""How the index set is chosen; see index_set."""


def index_set(kind: IndexSetKind, options: IndexSetOptions, scans: ScanSet, poses: Array) -> Indices:
    """The ordered pairs (m, 2) of n scans at the poses (n, 3) that are to be matched, sorted.

    `all`: every pair. `visible`: pairs in which the position of one scan lies in the free space that the
    other saw. `overlap`: pairs in which enough points of one scan fall into cells where the other has a
    Gaussian, or more points than for any other scan. The distance of the points from the Gaussian does not
    count, so starts may be poor. A scan can be in no pair.
    """
    n = len(poses)
    if kind == "all":
        return all_pairs(n)
    if kind == "visible":
        linked = _visible(scans, poses, options.beam_angle, options.visible_distance)
    else:
        shares = overlap_shares(scans, poses, options.stride)
        linked = shares >= options.least_share
        both = np.maximum(shares, shares.T)
        nearest = both.argmax(axis=1)
        linked[np.arange(n), nearest] = both[np.arange(n), nearest] > 0.0
    return np.ascontiguousarray(np.argwhere(linked | linked.T), dtype=np.int64)


@kernel
def _visible(scans: ScanSet, poses: Array, beam_angle: float, visible_distance: float) -> Mask:
    """(n, n) at [i, j] whether scan i saw the position of scan j."""
    n = poses.shape[0]
    visible, u = np.zeros((n, n), dtype=np.bool_), np.empty(3)
    for i in range(n):
        points = scan_points(scans, i)
        for j in range(n):
            if i == j:
                continue
            relative_pose(poses[j], poses[i], u)
            distance = np.hypot(u[0], u[1])
            if distance < visible_distance:
                visible[i, j] = True
                continue
            # The reach of the beam that is nearest in direction. For small angles, sines stand for them.
            nearest, reach = beam_angle, 0.0
            for k in range(points.shape[0]):
                x, y = points[k, 0], points[k, 1]
                length = np.sqrt(x * x + y * y)
                off = abs(x * u[1] - y * u[0])
                if off < nearest * length * distance and x * u[0] + y * u[1] > 0.0:
                    nearest, reach = off / (length * distance), length
            visible[i, j] = distance < reach
    return visible


@kernel
def overlap_shares(scans: ScanSet, poses: Array, stride: int) -> Array:
    """(n, n) at [i, j] the share of scan j's points in cells where scan i has a Gaussian.

    A Gaussian that the beam would hit from behind does not count. Of the points, one in `stride` counts.
    """
    n = poses.shape[0]
    shares, u = np.zeros((n, n)), np.empty(3)
    for j in range(n):
        points = scan_points(scans, j)[::stride]
        weight = 1.0 / max(points.shape[0], 1)
        for i in range(n):
            if i == j:
                continue
            relative_pose(poses[j], poses[i], u)
            grid = scan_grid(scans, i)
            cos, sin = np.cos(u[2]), np.sin(u[2])
            for k in range(points.shape[0]):
                rx = cos * points[k, 0] - sin * points[k, 1]
                ry = sin * points[k, 0] + cos * points[k, 1]
                cell = int(np.floor((rx + u[0]) / scans.half)), int(np.floor((ry + u[1]) / scans.half))
                row = find_row(grid, pack_key(cell[0], cell[1]))
                if row < 0:
                    continue
                for link in grid.links[row]:
                    if facing_gaussian(grid, link, rx, ry) >= 0:
                        shares[i, j] += weight
                        break
    return shares
