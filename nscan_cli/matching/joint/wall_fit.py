"""The walls that n scans see in common, and the poses that fit them best.

The Gaussians of one scan show a wall by pieces of a cell, each from a few points. Once the scans lie where
they belong, the points of all of them show it over its whole length, and how well the points of each scan lie
on it is a matter of least squares: with every wall a line that is estimated along with the poses, as in
bundle adjustment. The lines are eliminated (Schur complement); cells that adapt to what is flat find them, as
in Z. Liu, F. Zhang, "BALM: Bundle Adjustment for Lidar Mapping", RA-L 2021.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.assign import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.joint.gauge import gauge_fixed_step, gauge_of
from nscan_cli.matching.joint.scan_set import ScanSet
from nscan_cli.matching.small_matrices import multiply
from nscan_cli.poses import Array, wrap

CELL = 0.25
"""m; side of the smallest cell in which a wall is looked for."""
LEVELS = 5
"""Cells of twice the side each are looked at first: 4 m, 2 m and so on."""
LEAST_POINTS = 6
THIN = 0.02
"""m; greatest standard deviation of points across a wall: the noise of ranges, and little more."""
SLENDER = 10.0
"""A wall's variance along itself is at least so many times the one across."""
RANGE_SIGMA, WALL_SIGMA = 0.02, 0.005
"""m; standard deviations of a range along its beam, and of a wall from a line. A wall that the beams graze
is known more exactly across itself than one that they hit head-on."""
HELD = 0.2
"""Share of the Hessian of the match that holds the poses where no wall does."""
LOOSE = 10.0
"""The direction of a wall is known from its points, and off by their noise: along itself the wall then seems
to know as well. By so many times as much as that is, the poses are held there."""
STEPS = 2
"""Of Gauss and Newton. The problem is all but linear."""


class Cloud(NamedTuple):
    """The points of n scans in one frame."""

    points: Array
    """(m, 2)"""
    arms: Array
    """(m, 2) from the robot to the point."""
    scans: NDArray[np.int64]
    """(m,) which scan a point is of."""


def fit_to_walls(scans: ScanSet, poses: Array, hessian: Array, fixed: int | None) -> Array:
    """The poses (n, 3) near those of a joint match that fit the walls which two scans or more see best.

    `hessian` (3n, 3n) is that of the match's objective, `fixed` the scan that stays where it is; None
    leaves the gauge free.
    """
    fitted = poses.copy()
    _fit(scans, fitted, hessian, gauge_of(fixed))
    fitted[:, 2] = wrap(fitted[:, 2])
    return fitted


@kernel
def _fit(scans: ScanSet, poses: Array, hessian: Array, fixed: int) -> None:
    """Minimise Σ d² / σ² over the points on walls + ½ Δᵗ (HELD · H) Δ, from the poses (n, 3) in place."""
    start, step, gradient = poses.copy(), np.empty_like(poses), np.empty(poses.size)
    for _ in range(STEPS):
        cloud = _cloud(scans, poses)
        members, ends = common_walls(cloud)
        known = HELD * hessian
        multiply(known, (poses - start).ravel(), gradient)
        first = 0
        for end in ends:
            _add_wall(cloud, members[first:end], gradient, known)
            first = end
        if not gauge_fixed_step(gradient, known, poses, 0.0, fixed, step):
            return
        poses += step


@kernel
def _cloud(scans: ScanSet, poses: Array) -> Cloud:
    points, arms = np.empty_like(scans.points), np.empty_like(scans.points)
    of_scan = np.empty(points.shape[0], dtype=np.int64)
    for i in range(poses.shape[0]):
        cos, sin = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        for k in range(scans.starts[3, i], scans.starts[3, i + 1]):
            arms[k, 0] = cos * scans.points[k, 0] - sin * scans.points[k, 1]
            arms[k, 1] = sin * scans.points[k, 0] + cos * scans.points[k, 1]
            points[k, 0], points[k, 1] = arms[k, 0] + poses[i, 0], arms[k, 1] + poses[i, 1]
            of_scan[k] = i
    return Cloud(points, arms, of_scan)


@kernel
def common_walls(cloud: Cloud) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The walls that more than one scan sees: the points on them, wall by wall, and where each ends there.

    A cell is a wall when its points lie flat, those seen from either side for themselves; where they do
    not, its quarters are looked at.
    """
    m = cloud.points.shape[0]
    codes = _quadtree_codes(cloud.points)
    order = np.argsort(codes)
    taken = np.zeros(m, dtype=np.bool_)
    members, ends = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64)
    sides = np.empty(m, dtype=np.int64)
    count = walls = 0
    for level in range(LEVELS - 1, -1, -1):
        end = 0
        while end < m:
            first, cell = end, codes[order[end]] >> (2 * level)
            while end < m and codes[order[end]] >> (2 * level) == cell:
                end += 1
            if taken[first] or end - first < LEAST_POINTS:
                continue
            front = _split(cloud, order[first:end], sides)
            back = end - first - front
            if not (_is_flat(cloud, sides[:front]) and _is_flat(cloud, sides[front : front + back])):
                continue
            taken[first:end] = True
            for a, b in ((0, front), (front, front + back)):
                if b - a >= LEAST_POINTS and (cloud.scans[sides[a:b]] != cloud.scans[sides[a]]).any():
                    assign(members[count : count + b - a], sides[a:b])
                    count += b - a
                    ends[walls] = count
                    walls += 1
    return members[:count], ends[:walls]


@kernel
def _quadtree_codes(points: Array) -> NDArray[np.int64]:
    """The cells (m,) of points (m, 2), numbered so that those of a larger cell follow each other (Morton)."""
    codes = np.zeros(points.shape[0], dtype=np.int64)
    left, bottom = points[:, 0].min(), points[:, 1].min()
    for k in range(points.shape[0]):
        ix, iy = int((points[k, 0] - left) / CELL), int((points[k, 1] - bottom) / CELL)
        for bit in range(16):
            codes[k] |= ((ix >> bit) & 1) << (2 * bit) | ((iy >> bit) & 1) << (2 * bit + 1)
    return codes


@kernel
def _moments(cloud: Cloud, chosen: NDArray[np.int64]) -> tuple[float, float, float, float, float]:
    """Mean (x, y) and covariance (xx, xy, yy) of some points."""
    x = y = xx = xy = yy = 0.0
    for k in chosen:
        x += cloud.points[k, 0]
        y += cloud.points[k, 1]
    x, y = x / chosen.shape[0], y / chosen.shape[0]
    for k in chosen:
        dx, dy = cloud.points[k, 0] - x, cloud.points[k, 1] - y
        xx += dx * dx
        xy += dx * dy
        yy += dy * dy
    return x, y, xx / chosen.shape[0], xy / chosen.shape[0], yy / chosen.shape[0]


@kernel
def _is_flat(cloud: Cloud, chosen: NDArray[np.int64]) -> bool:
    """Whether points lie on a line; so few that they make no wall are in nobody's way."""
    if chosen.shape[0] < LEAST_POINTS:
        return True
    _, _, xx, xy, yy = _moments(cloud, chosen)
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    return bool(middle - radius <= min(THIN * THIN, (middle + radius) / SLENDER))


@kernel
def _split(cloud: Cloud, chosen: NDArray[np.int64], sides: NDArray[np.int64]) -> int:
    """Write the points to `sides`, first those whose beams run to one side of their line; how many are."""
    _, _, xx, xy, yy = _moments(cloud, chosen)
    along = 0.5 * np.arctan2(2 * xy, xx - yy)
    nx, ny = -np.sin(along), np.cos(along)
    front, back = 0, chosen.shape[0]
    for k in chosen:
        if cloud.arms[k, 0] * nx + cloud.arms[k, 1] * ny > 0.0:
            sides[front] = k
            front += 1
        else:
            back -= 1
            sides[back] = k
    return front


@kernel
def _add_wall(cloud: Cloud, chosen: NDArray[np.int64], gradient: Array, hessian: Array) -> None:
    """Add what the points on one wall say of the poses, with the wall's line eliminated.

    A point's residual is its distance d from the line, with J = ∂d/∂p_i = nᵗ ∂x'/∂p_i. The line may shift
    and turn: with u the place along it, counted from the weighted mean, these two directions are orthogonal,
    and take (Σ wJ)(Σ wJ)ᵗ / Σ w and (Σ wuJ)(Σ wuJ)ᵗ / Σ wu² from Σ wJJᵗ. The variance of the line's angle is
    1 / Σ wu²; so much of what the points would say along the line gets into Σ wJJᵗ by noise.
    """
    x, y, xx, xy, yy = _moments(cloud, chosen)
    along = 0.5 * np.arctan2(2 * xy, xx - yy)
    nx, ny = -np.sin(along), np.cos(along)
    m = chosen.shape[0]
    weights, places, off = np.empty(m), np.empty(m), np.empty(m)
    for at, k in enumerate(chosen):
        ax, ay = cloud.arms[k, 0], cloud.arms[k, 1]
        head_on = (ax * nx + ay * ny) ** 2 / (ax * ax + ay * ay + 1e-12)
        weights[at] = 1.0 / (RANGE_SIGMA * RANGE_SIGMA * head_on + WALL_SIGMA * WALL_SIGMA)
        dx, dy = cloud.points[k, 0] - x, cloud.points[k, 1] - y
        places[at], off[at] = dx * ny - dy * nx, dx * nx + dy * ny
    total = weights.sum()
    places -= (weights * places).sum() / total
    spread = (weights * places * places).sum()
    off -= (weights * off).sum() / total + places * ((weights * places * off).sum() / spread)
    loose = LOOSE / spread
    size = gradient.shape[0]
    shifts, turns, slips = np.zeros(size), np.zeros(size), np.zeros(size)
    across, by = np.empty(3), np.empty(3)
    for at, k in enumerate(chosen):
        ax, ay = cloud.arms[k, 0], cloud.arms[k, 1]
        across[0], across[1], across[2] = nx, ny, ax * ny - ay * nx
        by[0], by[1], by[2] = ny, -nx, -ax * nx - ay * ny
        first, weight = 3 * cloud.scans[k], weights[at]
        for a in range(3):
            gradient[first + a] += weight * off[at] * across[a]
            shifts[first + a] += weight * across[a]
            turns[first + a] += weight * places[at] * across[a]
            slips[first + a] += weight * by[a]
            for b in range(3):
                hessian[first + a, first + b] += weight * (across[a] * across[b] + loose * by[a] * by[b])
    for a in range(size):
        if slips[a] == 0.0 and shifts[a] == 0.0:
            continue
        for b in range(size):
            hessian[a, b] -= (shifts[a] * shifts[b] + loose * slips[a] * slips[b]) / total
            hessian[a, b] -= turns[a] * turns[b] / spread
