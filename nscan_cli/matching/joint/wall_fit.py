"""Walls that several scans see, and the poses that fit them best.

The Gaussians of one scan describe a wall cell by cell, each from few points. Once scans are matched, the
points of all of them show the wall over its whole length. Every wall is a line that is estimated along with
the poses by least squares, as in bundle adjustment, and eliminated (Schur complement). Adaptive cells find
the walls, as in Z. Liu, F. Zhang, "BALM: Bundle Adjustment for Lidar Mapping", RA-L 2021.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.array_assignment import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.joint.gauge import gauge_fixed_step, gauge_of
from nscan_cli.matching.joint.options import WallFitOptions
from nscan_cli.matching.joint.scan_set import ScanSet
from nscan_cli.matching.small_matrices import multiply
from nscan_cli.poses import Array, Indices, wrap


class PointCloud(NamedTuple):
    """The points of n scans in one frame."""

    points: Array
    """(m, 2)"""
    arms: Array
    """(m, 2) the vector from the robot to each point."""
    scans: Indices
    """(m,) the index of the scan of each point."""


def fit_to_walls(
    scans: ScanSet, poses: Array, hessian: Array, fixed: int | None, options: WallFitOptions
) -> Array:
    """The poses (n, 3) of a joint match, fitted to the walls that at least two scans see.

    `hessian` (3n, 3n) is that of the match's objective, `fixed` the scan that stays where it is; None leaves
    the gauge free.
    """
    fitted = poses.copy()
    _fit(scans, fitted, hessian, gauge_of(fixed), options)
    fitted[:, 2] = wrap(fitted[:, 2])
    return fitted


@kernel
def _fit(scans: ScanSet, poses: Array, hessian: Array, fixed: int, options: WallFitOptions) -> None:
    """Minimise Σ d² / σ² of points on walls + ½ Δᵗ (prior_share · H) Δ, from the poses (n, 3) in place."""
    start, step, gradient = poses.copy(), np.empty_like(poses), np.empty(poses.size)
    for _ in range(options.steps):
        cloud = _point_cloud(scans, poses)
        members, ends = common_walls(cloud, options)
        information = options.prior_share * hessian
        multiply(information, (poses - start).ravel(), gradient)
        first = 0
        for end in ends:
            _add_wall(cloud, members[first:end], options, gradient, information)
            first = end
        if not gauge_fixed_step(gradient, information, poses, 0.0, fixed, step):
            return
        poses += step


@kernel
def _point_cloud(scans: ScanSet, poses: Array) -> PointCloud:
    """The points of all scans at the poses (n, 3)."""
    points, arms = np.empty_like(scans.points), np.empty_like(scans.points)
    of_scan = np.empty(points.shape[0], dtype=np.int64)
    for i in range(poses.shape[0]):
        cos, sin = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        for k in range(scans.starts[3, i], scans.starts[3, i + 1]):
            arms[k, 0] = cos * scans.points[k, 0] - sin * scans.points[k, 1]
            arms[k, 1] = sin * scans.points[k, 0] + cos * scans.points[k, 1]
            points[k, 0], points[k, 1] = arms[k, 0] + poses[i, 0], arms[k, 1] + poses[i, 1]
            of_scan[k] = i
    return PointCloud(points, arms, of_scan)


@kernel
def common_walls(cloud: PointCloud, options: WallFitOptions) -> tuple[Indices, Indices]:
    """The walls that more than one scan sees: their points, wall by wall, and the end of each among them.

    A cell holds a wall if the points that are seen from either side lie on a line. Otherwise its quarters
    are tested.
    """
    m = cloud.points.shape[0]
    codes = _quadtree_codes(cloud.points, options.cell)
    order = np.argsort(codes)
    taken = np.zeros(m, dtype=np.bool_)
    members, ends = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64)
    sides = np.empty(m, dtype=np.int64)
    count = walls = 0
    for level in range(options.levels - 1, -1, -1):
        end = 0
        while end < m:
            first, cell = end, codes[order[end]] >> (2 * level)
            while end < m and codes[order[end]] >> (2 * level) == cell:
                end += 1
            if taken[first] or end - first < options.minimum:
                continue
            front, size = _split_by_side(cloud, order[first:end], sides), end - first
            if not (_is_line(cloud, sides[:front], options) and _is_line(cloud, sides[front:size], options)):
                continue
            taken[first:end] = True
            for a, b in ((0, front), (front, size)):
                if b - a >= options.minimum and (cloud.scans[sides[a:b]] != cloud.scans[sides[a]]).any():
                    assign(members[count : count + b - a], sides[a:b])
                    count += b - a
                    ends[walls] = count
                    walls += 1
    return members[:count], ends[:walls]


@kernel
def _quadtree_codes(points: Array, cell: float) -> Indices:
    """The Morton codes (m,) of the cells of points (m, 2): quarters of a larger cell follow each other."""
    codes = np.zeros(points.shape[0], dtype=np.int64)
    left, bottom = points[:, 0].min(), points[:, 1].min()
    for k in range(points.shape[0]):
        ix, iy = int((points[k, 0] - left) / cell), int((points[k, 1] - bottom) / cell)
        for bit in range(16):
            codes[k] |= ((ix >> bit) & 1) << (2 * bit) | ((iy >> bit) & 1) << (2 * bit + 1)
    return codes


@kernel
def _moments(cloud: PointCloud, chosen: Indices) -> tuple[float, float, float, float, float]:
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
def _is_line(cloud: PointCloud, chosen: Indices, options: WallFitOptions) -> bool:
    """Whether points lie on a line, or are too few for a wall."""
    if chosen.shape[0] < options.minimum:
        return True
    _, _, xx, xy, yy = _moments(cloud, chosen)
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    thickness, elongation = options.thickness, options.elongation
    return bool(middle - radius <= min(thickness * thickness, (middle + radius) / elongation))


@kernel
def _split_by_side(cloud: PointCloud, chosen: Indices, sides: Indices) -> int:
    """Write the points to `sides`, first those seen from one side of their line; the number of these."""
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
def _add_wall(
    cloud: PointCloud, chosen: Indices, options: WallFitOptions, gradient: Array, hessian: Array
) -> None:
    """Add the derivatives of the points' distances from one wall, with the wall's line eliminated.

    A point's residual is its distance d from the line, with J = ∂d/∂p_i = nᵗ ∂x'/∂p_i. The line may shift and
    turn. With u the position along it from the weighted mean, these two directions are orthogonal, and their
    elimination subtracts (Σ wJ)(Σ wJ)ᵗ / Σ w and (Σ wuJ)(Σ wuJ)ᵗ / Σ wu² from Σ wJJᵗ. The variance of the
    line's angle is 1 / Σ wu²; by its noise Σ wJJᵗ claims that much information along the line.
    """
    x, y, xx, xy, yy = _moments(cloud, chosen)
    along = 0.5 * np.arctan2(2 * xy, xx - yy)
    nx, ny = -np.sin(along), np.cos(along)
    m, range_variance = chosen.shape[0], options.range_sigma * options.range_sigma
    weights, along_line, distances = np.empty(m), np.empty(m), np.empty(m)
    for at, k in enumerate(chosen):
        ax, ay = cloud.arms[k, 0], cloud.arms[k, 1]
        head_on = (ax * nx + ay * ny) ** 2 / (ax * ax + ay * ay + 1e-12)
        weights[at] = 1.0 / (range_variance * head_on + options.wall_sigma * options.wall_sigma)
        dx, dy = cloud.points[k, 0] - x, cloud.points[k, 1] - y
        along_line[at], distances[at] = dx * ny - dy * nx, dx * nx + dy * ny
    total = weights.sum()
    along_line -= (weights * along_line).sum() / total
    spread = (weights * along_line * along_line).sum()
    distances -= (weights * distances).sum() / total + along_line * (
        (weights * along_line * distances).sum() / spread
    )
    angle_noise = options.direction_noise / spread
    size = gradient.shape[0]
    shifts, turns, slides = np.zeros(size), np.zeros(size), np.zeros(size)
    across, by = np.empty(3), np.empty(3)
    for at, k in enumerate(chosen):
        ax, ay = cloud.arms[k, 0], cloud.arms[k, 1]
        across[0], across[1], across[2] = nx, ny, ax * ny - ay * nx
        by[0], by[1], by[2] = ny, -nx, -ax * nx - ay * ny
        first, weight = 3 * cloud.scans[k], weights[at]
        for a in range(3):
            gradient[first + a] += weight * distances[at] * across[a]
            shifts[first + a] += weight * across[a]
            turns[first + a] += weight * along_line[at] * across[a]
            slides[first + a] += weight * by[a]
            for b in range(3):
                held = across[a] * across[b] + angle_noise * by[a] * by[b]
                hessian[first + a, first + b] += weight * held
    for a in range(size):
        if slides[a] == 0.0 and shifts[a] == 0.0:
            continue
        for b in range(size):
            hessian[a, b] -= (shifts[a] * shifts[b] + angle_noise * slides[a] * slides[b]) / total
            hessian[a, b] -= turns[a] * turns[b] / spread
