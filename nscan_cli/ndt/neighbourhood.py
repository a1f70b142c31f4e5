"""Corrections of a Gaussian by its neighbourhood: the direction of a wall, and the ends of walls.

Neither is in [19]. The direction is corrected in the NDT of a single scan, the ends of walls in that of a
keyframe, to which many scans contribute. WallOptions has the thresholds.
"""

from __future__ import annotations

from nscan_cli.kernels.decorators import leaf_kernel
from nscan_cli.ndt.gaussians import (
    NO_MOMENTS,
    Direction,
    Moments,
    eigenvalue_radius,
    eigenvalues,
    face_moments,
    long_axis_of,
    moments_of_sums,
    plus_cell,
    write_gaussian,
)
from nscan_cli.ndt.hash_grid import COSINE, ELONGATION, END_RATIO, END_SHARE, FLOOR, HALF_KEY, Grid, find_row
from nscan_cli.poses import Array

WIDE_MARGIN, NARROW_MARGIN = 2, 1
"""Widths of the neighbourhood around a block in lattice cells; the wider one is tried first."""


@leaf_kernel
def align_with_neighbourhood(grid: Grid, row: int, half: float) -> None:
    """Give a piece of wall the direction of its neighbourhood, where that is as flat.

    The noise of few points turns a Gaussian, so that it claims information along the wall. Over twice the
    length it claims eight times less.
    """
    key, gaussian = grid.keys[row], grid.gaussians[row]
    front, back = face_moments(grid, row, half)
    if front[0] > 0.0:
        write_gaussian(grid, key, front, _long_axis_around(grid, key, front, half), half, gaussian)
    if back[0] > 0.0:
        other = grid.gaussians[int(gaussian[7])]
        write_gaussian(grid, key, back, _long_axis_around(grid, key, back, half), half, other)


@leaf_kernel
def drop_along_wall_information(grid: Grid, row: int, half: float) -> None:
    """Remove the information of a wall's end along the wall.

    Mostly the view ended there. The few points lie at one side of the block, and their mean attracts points
    of the rest of the block. With a laser that sees a few metres, scans along a corridor would be pulled
    together by 2 % of the distance. A corner or a door post is not flat, and keeps its information.
    """
    gaussian = grid.gaussians[row]
    has_back = gaussian[7] > 0.0
    shortest = grid.settings[END_SHARE] * 2 * half
    front_ends = _is_shorter(gaussian, shortest)
    back_ends = has_back and _is_shorter(grid.gaussians[int(gaussian[7])], shortest)
    if not (front_ends or back_ends):
        return
    for margin in (WIDE_MARGIN, NARROW_MARGIN):
        wide = _moments_around(grid, grid.keys[row], margin, half)
        small, large = eigenvalues(grid, wide)
        if grid.settings[ELONGATION] * small < min(large, _wall_variance(2 * half)):
            front, back = face_moments(grid, row, half)
            if front_ends:
                _write_line(grid, front, wide, gaussian)
            if back_ends:
                _write_line(grid, back, wide, grid.gaussians[int(gaussian[7])])
            return


@leaf_kernel
def _is_shorter(gaussian: Array, length: float) -> bool:
    """Whether a Gaussian is shorter than that of a piece of wall of a length (m).

    With eigenvalues λ > σ² of its covariance, the inverse is σ⁴/λ³ along the wall; see gaussians.py.
    """
    xx, xy, yy = gaussian[2], gaussian[3], gaussian[4]
    middle, radius = 0.5 * (xx + yy), eigenvalue_radius(xx, xy, yy)
    along, across = middle - radius, middle + radius
    return bool(along * across**2 * _wall_variance(length) ** 3 > 1.0)


@leaf_kernel
def _wall_variance(length: float) -> float:
    """The variance (m²) of points spread evenly over a piece of wall of a length (m)."""
    return length * length / 12


@leaf_kernel
def _write_line(grid: Grid, moments: Moments, wide: Moments, gaussian: Array) -> None:
    """Make a Gaussian with these moments a line in the direction of its neighbourhood, if it is as flat."""
    (_, _, _, xx, xy, yy, _, _), (c2, s2) = moments, long_axis_of(wide)
    variance, small = 0.5 * (xx + yy - (xx - yy) * c2) - xy * s2, eigenvalues(grid, wide)[0]
    if variance > grid.settings[END_RATIO] * small:
        return
    half_across = 0.5 / max(variance, grid.settings[FLOOR] * grid.settings[FLOOR])
    gaussian[2] = half_across * (1 - c2)
    gaussian[3] = -half_across * s2
    gaussian[4] = half_across * (1 + c2)


@leaf_kernel
def _long_axis_around(grid: Grid, key: int, moments: Moments, half: float) -> Direction:
    """The direction of a piece of wall, from its neighbourhood where that is as flat."""
    long_axis = long_axis_of(moments)
    small, large = eigenvalues(grid, moments)
    if large <= grid.settings[ELONGATION] * small:
        return long_axis
    for margin in (WIDE_MARGIN, NARROW_MARGIN):
        wide = _moments_around(grid, key, margin, half)
        _, _, _, xx, xy, yy, _, _ = wide
        c2, s2 = long_axis_of(wide)
        flat = 0.5 * (xx + yy) - eigenvalue_radius(xx, xy, yy) < small
        if flat and c2 * long_axis[0] + s2 * long_axis[1] > grid.settings[COSINE]:
            return c2, s2
    return long_axis


@leaf_kernel
def _moments_around(grid: Grid, key: int, margin: int, half: float) -> Moments:
    """The moments of a block and a margin of lattice cells, about the centre of the cell of `key`."""
    sums = NO_MOMENTS
    for oy in range(-margin, 2 + margin):
        for ox in range(-margin, 2 + margin):
            cell = find_row(grid, key + ox * 2 * HALF_KEY + oy)
            for side in range(2 if cell >= 0 else 0):
                sums = plus_cell(sums, grid.sums[cell, side], ox * half, oy * half)
    return moments_of_sums(sums)
