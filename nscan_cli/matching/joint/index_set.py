"""The index set J: which pairs of scans are matched with each other (paper, III-B; V leaves open how).

Both ways round of a pair go in, since each scan is matched with the Gaussians of the other.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import leaf_kernel
from nscan_cli.matching.joint.joint_energy import all_pairs
from nscan_cli.matching.joint.scan_set import ScanSet, scan_grid, scan_points
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.ndt.hash_grid import find_row, pack, shown
from nscan_cli.poses import Array

Kind = Literal["all", "visible", "overlap"]
"""How the index set is chosen; see index_set."""
BESIDE = 0.05
"""rad; a position farther than this beside every beam was not seen. Neighbouring beams of a laser with 180 of
them are 0.017 apart."""
AT_HAND = 0.3
"""m; a position so near was seen in any case: the robot stands there."""
LEAST_SHARE = 0.15
"""Two scans are matched when so large a share of the points of one falls where the other has Gaussians.

On problems of ten scans from odometry, more of them are solved with 0.25; but pairs with little in common can
be what ties all together, as in the paper's Fig. 3, and are lost then."""
EVERY = 3
"""Of the points, these many tell the share as well as all."""


def index_set(kind: Kind, scans: ScanSet, poses: Array) -> NDArray[np.int64]:
    """The ordered pairs (m, 2) to be matched of n scans at the poses (n, 3), sorted.

    `all`: every pair. `visible`: the position of one scan lies in the free space that the other saw.
    `overlap`: enough of one's points fall into cells where the other has a Gaussian, or more than with any
    other scan. How well they lie on it does not count, so that starts may be poor. A scan can be in no pair.
    """
    n = len(poses)
    if kind == "all":
        return all_pairs(n)
    shares = np.zeros((n, n))
    if kind == "visible":
        _see(scans, poses, np.empty(3), shares)
        linked = shares > 0.0
    else:
        _meet(scans, poses, np.empty(3), shares)
        linked = shares >= LEAST_SHARE
        both = np.maximum(shares, shares.T)
        nearest = both.argmax(axis=1)
        linked[np.arange(n), nearest] = both[np.arange(n), nearest] > 0.0
    return np.ascontiguousarray(np.argwhere(linked | linked.T), dtype=np.int64)


@leaf_kernel
def _see(scans: ScanSet, poses: Array, u: Array, shares: Array) -> None:
    """Write 1 to shares (n, n) at [i, j] where scan i saw the position of scan j; u (3,) is room."""
    n = poses.shape[0]
    for i in range(n):
        points = scan_points(scans, i)
        for j in range(n):
            if i == j:
                continue
            relative_pose(poses[j], poses[i], u)
            distance = np.hypot(u[0], u[1])
            if distance < AT_HAND:
                shares[i, j] = 1.0
                continue
            # The beam that is nearest in direction; sines will do for small angles.
            beside, reach = BESIDE, 0.0
            for k in range(points.shape[0]):
                x, y = points[k, 0], points[k, 1]
                length = np.sqrt(x * x + y * y)
                off = abs(x * u[1] - y * u[0])
                if off < beside * length * distance and x * u[0] + y * u[1] > 0.0:
                    beside, reach = off / (length * distance), length
            if distance < reach:
                shares[i, j] = 1.0


@leaf_kernel
def _meet(scans: ScanSet, poses: Array, u: Array, shares: Array) -> None:
    """Write to shares (n, n) at [i, j] how much of scan j falls into cells where scan i has a Gaussian.

    One that a beam would hit from behind does not count. `u` (3,) is room.
    """
    n = poses.shape[0]
    for j in range(n):
        points = scan_points(scans, j)[::EVERY]
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
                row = find_row(grid, pack(cell[0], cell[1]))
                if row < 0:
                    continue
                for link in grid.links[row]:
                    # Blocks with too few points have no Gaussian, nor a link to one; see Ndt.compact.
                    if shown(grid, link, rx, ry) >= 0:
                        shares[i, j] += weight
                        break
