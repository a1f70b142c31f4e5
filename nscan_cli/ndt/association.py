"""Association of a scan's points with Gaussians: looked up at one pose, or updated while the pose changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.ndt.gaussians import make_gaussian
from nscan_cli.ndt.hash_grid import OUTDATED, Grid, facing_gaussian, find_row, pack_key
from nscan_cli.poses import Array

BLOCKS = 4
"""Blocks of a lattice cell: the most Gaussians that a point is associated with."""
PAIR_NUMBERS = 7
"""Numbers of a pair of a point and a Gaussian; see AssociationBuffers."""
GAUSSIAN_NUMBERS = 7
"""Numbers of a Gaussian that the energy needs; see Grid."""


class AssociationBuffers(NamedTuple):
    """Buffers for n points and their pairs with Gaussians. Symbols are those of energy.py."""

    moved: Array
    """(4, n) of each point: R(φ) x, and the lattice coordinates of x'."""
    pairs: Array
    """(7, 4 n) of each pair: R(φ) x, v, and Σ⁻¹ as (xx, xy, yy)."""


@kernel
def association_buffers(points: int, stride: int) -> AssociationBuffers:
    """Buffers for a number of points, of which one in `stride` counts."""
    n = (points + stride - 1) // stride
    return AssociationBuffers(np.empty((4, n)), np.empty((PAIR_NUMBERS, BLOCKS * n)))


@leaf_kernel
def associate_once(
    grid: Grid, half: float, points: Array, pose: Array, stride: int, buffers: AssociationBuffers
) -> int:
    """Write the pairs of points (m, 2), moved by `pose` (3,), and Gaussians to `buffers.pairs`.

    Of the points, one in `stride` counts. Returns the number of pairs.
    """
    x, y, phi = pose[0], pose[1], pose[2]
    moved, pairs = buffers.moved, buffers.pairs
    n = (points.shape[0] + stride - 1) // stride
    # All points first, in lanes: the processor cannot predict where a look-up ends.
    _transform_points(points, x, y, np.cos(phi), np.sin(phi), half, stride, n, moved)
    count, row, key = 0, -1, -1
    for k in range(n):
        cell = pack_key(int(moved[2, k]), int(moved[3, k]))
        # Neighbouring beams mostly fall into the same cell.
        if cell != key:
            key, row = cell, find_row(grid, cell)
        if row < 0:
            continue
        rx, ry = moved[0, k], moved[1, k]
        for block in range(BLOCKS):
            link = facing_gaussian(grid, grid.links[row, block], rx, ry)
            if link < 0:
                continue
            gaussian = grid.gaussians[link]
            # An unsigned index needs no test for negative values.
            c = np.uint64(count)
            pairs[0, c], pairs[1, c] = rx, ry
            pairs[2, c], pairs[3, c] = rx + x - gaussian[0], ry + y - gaussian[1]
            pairs[4, c], pairs[5, c], pairs[6, c] = gaussian[2], gaussian[3], gaussian[4]
            count += 1
    return count


@leaf_kernel
def _transform_points(
    points: Array, x: float, y: float, cos: float, sin: float, half: float, stride: int, n: int, moved: Array
) -> None:
    """Write n moved points and their cells; see AssociationBuffers."""
    for k in range(n):
        at = np.uint64(k * stride)
        rx = cos * points[at, 0] - sin * points[at, 1]
        ry = sin * points[at, 0] + cos * points[at, 1]
        moved[0, k], moved[1, k] = rx, ry
        moved[2, k], moved[3, k] = np.floor((rx + x) / half), np.floor((ry + y) / half)


class Association(NamedTuple):
    """m points at the last pose, and the Gaussians that they are associated with there."""

    points: Array
    """(2, m) the points in the frame of their scan."""
    cells: Array
    """(2, m) the lattice coordinates for which the Gaussians were looked up; nan before the first pose."""
    cells_now: Array
    """(2, m) the lattice coordinates at the new pose, before the look-up."""
    moved: Array
    """(4, m) R(φ) x, and x'."""
    gaussians: Array
    """(4, 7, m) the Gaussians of the four blocks of each point; 0 where there is none."""


@kernel
def begin_association(points: Array) -> Association:
    """The association of points (m, 2) before the first pose."""
    m = points.shape[0]
    cells = np.full((2, m), np.nan)
    association = Association(
        np.empty((2, m)), cells, np.empty((2, m)), np.empty((4, m)), np.empty((BLOCKS, GAUSSIAN_NUMBERS, m))
    )
    for k in range(m):
        association.points[0, k], association.points[1, k] = points[k, 0], points[k, 1]
    return association


@leaf_kernel
def update_association(grid: Grid, half: float, association: Association, pose: Array) -> None:
    """Move the points to `pose` (3,), and look up the Gaussians of points that change their cell.

    Outdated Gaussians there are made again.
    """
    cells, cells_now = association.cells, association.cells_now
    changed = _move_points(association, pose[0], pose[1], np.cos(pose[2]), np.sin(pose[2]), half)
    # After a short step mostly no point changes its cell.
    for k in range(cells.shape[1] if changed else 0):
        ix, iy = cells_now[0, k], cells_now[1, k]
        if ix != cells[0, k] or iy != cells[1, k]:
            cells[0, k], cells[1, k] = ix, iy
            row = find_row(grid, pack_key(int(ix), int(iy)))
            for block in range(BLOCKS):
                link = -1 if row < 0 else grid.links[row, block]
                if link >= 0 and grid.gaussians[link, 2] == OUTDATED:
                    make_gaussian(grid, link, half)
                link = facing_gaussian(grid, link, association.moved[0, k], association.moved[1, k])
                if link < 0:
                    association.gaussians[block, :, k] = 0.0
                    continue
                gaussian = grid.gaussians[link]
                for number in range(GAUSSIAN_NUMBERS):
                    association.gaussians[block, number, k] = gaussian[number]


@leaf_kernel
def count_inliers(association: Association, bound: float) -> int:
    """The number of points within a Mahalanobis distance² of `bound` of an associated Gaussian."""
    moved, gaussians = association.moved, association.gaussians
    count = 0
    for k in range(moved.shape[1]):
        is_inlier = False
        for block in range(BLOCKS):
            vx, vy = moved[2, k] - gaussians[block, 0, k], moved[3, k] - gaussians[block, 1, k]
            xx, xy, yy = gaussians[block, 2, k], gaussians[block, 3, k], gaussians[block, 4, k]
            faces = gaussians[block, 5, k] * moved[0, k] + gaussians[block, 6, k] * moved[1, k] <= 0.0
            # `&` is no branch, unlike `and`.
            is_inlier |= faces & (xx > 0.0) & (xx * vx * vx + 2 * xy * vx * vy + yy * vy * vy < bound)
        count += is_inlier
    return count


@leaf_kernel
def _move_points(association: Association, x: float, y: float, cos: float, sin: float, half: float) -> int:
    """Write the moved points and their cells; the number of points that change their cell."""
    points, cells, cells_now, moved, _ = association
    changed = 0
    for k in range(points.shape[1]):
        rx = cos * points[0, k] - sin * points[1, k]
        ry = sin * points[0, k] + cos * points[1, k]
        ix, iy = np.floor((rx + x) / half), np.floor((ry + y) / half)
        moved[0, k], moved[1, k], moved[2, k], moved[3, k] = rx, ry, rx + x, ry + y
        cells_now[0, k], cells_now[1, k] = ix, iy
        changed += (ix != cells[0, k]) | (iy != cells[1, k])
    return changed
