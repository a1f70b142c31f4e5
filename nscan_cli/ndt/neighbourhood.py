"""What the surroundings of a piece of wall tell of it: its direction, and whether it only ends here.

Neither is in [19], where each Gaussian stands for itself. In the Gaussians of a single scan the direction
counts, in those of a keyframe, which many scans fill, where a wall ends.
"""

from __future__ import annotations

from nscan_cli.kernels.decorators import leaf_kernel
from nscan_cli.ndt.gaussians import (
    NOTHING,
    Direction,
    Moments,
    divided,
    eigenvalues,
    faces,
    long_axis_of,
    plus,
    radius_of,
    shape,
)
from nscan_cli.ndt.hash_grid import FLOOR, HALF_KEY, Grid, find_row
from nscan_cli.poses import Array

THIN = 10.0
"""A Gaussian is a piece of wall when its larger eigenvalue is so many times the smaller one."""
SAME_DIRECTION = 0.9
"""Cosine of twice the angle by which the direction from a larger block may differ."""
FILLED = 0.75
"""A wall ends in a block of which it fills less than such a share of the side,"""
AS_FLAT = 1.5
"""and nothing stands out if the variance across is no more than so many times that of what is around."""
WIDE, NARROW = 2, 1
"""Lattice cells around a block that are asked, the wider surroundings first."""


@leaf_kernel
def straighten(grid: Grid, row: int, half: float) -> None:
    """Let a piece of wall take its direction from the block of twice the size around it.

    Where the points there lie as flat as its own. A direction that is off by the noise of its few points
    tells a way along the wall that nobody knows, and eight times less from twice the length.
    """
    key, gaussian = grid.keys[row], grid.gaussians[row]
    front, back = faces(grid, row, half)
    if front[0] > 0.0:
        shape(grid, key, front, _long_axis_around(grid, key, front, half), half, gaussian)
    if back[0] > 0.0:
        other = grid.gaussians[int(gaussian[7])]
        shape(grid, key, back, _long_axis_around(grid, key, back, half), half, other)


@leaf_kernel
def drop_along_wall_information(grid: Grid, row: int, half: float) -> None:
    """Let the end of a wall hold nothing along the wall.

    Mostly it is where the view ended. The mean of the few points there lies at one side of the block, and
    draws whatever is seen of the rest of it: scans of a laser that sees no farther than a few metres are
    pulled together along a corridor by 2 % of the way. A corner or a door post stands out, and holds.
    """
    gaussian = grid.gaussians[row]
    has_back = gaussian[7] > 0.0
    front_ends = _is_short(gaussian, half)
    back_ends = has_back and _is_short(grid.gaussians[int(gaussian[7])], half)
    if not (front_ends or back_ends):
        return
    for around in (WIDE, NARROW):
        wide = _around(grid, grid.keys[row], around, half)
        small, large = eigenvalues(grid, wide)
        if THIN * small < min(large, _variance_of(2 * half)):
            front, back = faces(grid, row, half)
            if front_ends:
                _hold_across(grid, front, wide, gaussian)
            if back_ends:
                _hold_across(grid, back, wide, grid.gaussians[int(gaussian[7])])
            return


@leaf_kernel
def _is_short(gaussian: Array, half: float) -> bool:
    """Whether the larger eigenvalue λ of a Gaussian is that of a wall as long as FILLED of a block's side.

    Or of a shorter one. With a smaller eigenvalue of σ² the inverse has σ⁴/λ³ along it, see gaussians.py.
    """
    xx, xy, yy = gaussian[2], gaussian[3], gaussian[4]
    middle, radius = 0.5 * (xx + yy), radius_of(xx, xy, yy)
    along, across = middle - radius, middle + radius
    return bool(along * across**2 * _variance_of(FILLED * 2 * half) ** 3 > 1.0)


@leaf_kernel
def _variance_of(length: float) -> float:
    """That of points all along a piece of wall."""
    return length * length / 12


@leaf_kernel
def _hold_across(grid: Grid, moments: Moments, wide: Moments, gaussian: Array) -> None:
    """Make a Gaussian with these moments a line that runs as its surroundings do, if it lies as flat."""
    (_, _, _, xx, xy, yy, _, _), (c2, s2) = moments, long_axis_of(wide)
    variance, small = 0.5 * (xx + yy - (xx - yy) * c2) - xy * s2, eigenvalues(grid, wide)[0]
    if variance > AS_FLAT * small:
        return
    half_across = 0.5 / max(variance, grid.making[FLOOR] * grid.making[FLOOR])
    gaussian[2] = half_across * (1 - c2)
    gaussian[3] = -half_across * s2
    gaussian[4] = half_across * (1 + c2)


@leaf_kernel
def _long_axis_around(grid: Grid, key: int, moments: Moments, half: float) -> Direction:
    """The direction of a piece of wall, from around it if possible; see straighten."""
    long_axis = long_axis_of(moments)
    small, large = eigenvalues(grid, moments)
    if large <= THIN * small:
        return long_axis
    for around in (WIDE, NARROW):
        wide = _around(grid, key, around, half)
        _, _, _, xx, xy, yy, _, _ = wide
        c2, s2 = long_axis_of(wide)
        flat = 0.5 * (xx + yy) - radius_of(xx, xy, yy) < small
        if flat and c2 * long_axis[0] + s2 * long_axis[1] > SAME_DIRECTION:
            return c2, s2
    return long_axis


@leaf_kernel
def _around(grid: Grid, key: int, around: int, half: float) -> Moments:
    """Of a block and so many lattice cells around it, from the centre of the cell of `key`."""
    sums = NOTHING
    for oy in range(-around, 2 + around):
        for ox in range(-around, 2 + around):
            cell = find_row(grid, key + ox * 2 * HALF_KEY + oy)
            for side in range(2 if cell >= 0 else 0):
                sums = plus(sums, grid.sums[cell, side], ox * half, oy * half)
    return divided(sums)
