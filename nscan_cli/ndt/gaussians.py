"""One Gaussian of an NDT from the sums of its lattice cells ([19]).

Two things differ from [19]. The inverse of the larger eigenvalue is multiplied by the square of the ratio of
the smaller to the larger one, so that a piece of wall, long and thin, hardly holds a point along itself. The
spread of points along a wall depends on where the beams fell, not on where the wall is. Unchanged, it would
drag the robot back in corridors, and the Hessian would claim to know the position along them.

A Gaussian also has the side from which it was seen. A wall that is seen from a room and from the corridor has
two faces, 10 or 15 cm apart. Matched with each other, they pull scans together by that distance, and one
Gaussian of both pulls scans into the wall. The points of a block are therefore split by the side that their
beams come from. Each side has a Gaussian of its own, and a beam is associated with the one whose face it
hits.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import leaf_kernel, llvm_inline_kernel
from nscan_cli.ndt.hash_grid import (
    FACES,
    FLOOR,
    HALF_KEY,
    LEAST_RATIO,
    MINIMUM,
    SIDE_SHARE,
    Grid,
    find_row,
    unpack_key,
)
from nscan_cli.poses import Array

Cells = tuple[int | np.int32, int, int, int]
"""Rows of the four lattice cells of a block, or −1."""
Moments = tuple[float, float, float, float, float, float, float, float]
"""Number of points, their mean (x, y), covariance (xx, xy, yy), and the mean unit vector along the beams.
Before the division by the number: their sums."""
Direction = tuple[float, float]
"""Cosine and sine of twice the angle of the long axis of a covariance."""
NO_MOMENTS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The moments of no points."""


@leaf_kernel
def make_gaussian(grid: Grid, row: int, half: float) -> None:
    """Make the Gaussian of the block of four lattice cells whose lower left one is `row`.

    There are two Gaussians if the points lie on two faces of a wall and the grid has faces.
    """
    key, gaussian, other = grid.keys[row], grid.gaussians[row], grid.keys.shape[0] + row
    if gaussian[7] > 0.0:
        grid.gaussians[other, 2] = 0.0
    gaussian[:] = 0.0
    front, back = face_moments(grid, row, half)
    if front[0] > 0.0:
        write_gaussian(grid, key, front, long_axis_of(front), half, gaussian)
    if back[0] > 0.0:
        gaussian[7] = other
        write_gaussian(grid, key, back, long_axis_of(back), half, grid.gaussians[other])


@llvm_inline_kernel
def write_gaussian(
    grid: Grid, key: int, moments: Moments, long_axis: Direction, half: float, gaussian: Array
) -> None:
    """Write the Gaussian with the given moments about the centre of the cell of `key`."""
    (_, mx, my, _, _, _, fx, fy), (c2, s2) = moments, long_axis
    small, large = eigenvalues(grid, moments)
    along = small * small / (large * large * large)
    mean, half_gap = 0.5 * (along + 1 / small), 0.5 * (along - 1 / small)
    ix, iy = unpack_key(key)
    gaussian[0] = (ix + 0.5) * half + mx
    gaussian[1] = (iy + 0.5) * half + my
    gaussian[2] = mean + half_gap * c2
    gaussian[3] = half_gap * s2
    gaussian[4] = mean - half_gap * c2
    nx, ny = _normal(long_axis)
    through = fx * nx + fy * ny
    gaussian[5] = gaussian[6] = 0.0
    if abs(through) > grid.settings[SIDE_SHARE]:
        side = -1.0 if through > 0.0 else 1.0
        gaussian[5], gaussian[6] = side * nx, side * ny


@leaf_kernel
def eigenvalues(grid: Grid, moments: Moments) -> tuple[float, float]:
    """The eigenvalues of a covariance, increasing: at least the squared floor, and not too different."""
    _, _, _, xx, xy, yy, _, _ = moments
    middle, radius, floor = 0.5 * (xx + yy), eigenvalue_radius(xx, xy, yy), grid.settings[FLOOR]
    large = max(middle + radius, floor * floor)
    return max(middle - radius, floor * floor, grid.settings[LEAST_RATIO] * large), large


@llvm_inline_kernel
def face_moments(grid: Grid, row: int, half: float) -> tuple[Moments, Moments]:
    """The moments of the points of the block of `row`, and of those on the other face of a wall there.

    Either are NO_MOMENTS if there are too few points.
    """
    above, right = grid.keys[row] + 1, grid.keys[row] + 2 * HALF_KEY
    cells = np.int32(row), find_row(grid, right), find_row(grid, above), find_row(grid, right + 1)
    minimum, has_faces = grid.settings[MINIMUM], grid.settings[FACES] > 0.0
    whole, normal = _block_sums(grid, cells, half)
    if whole[0] < minimum:
        return NO_MOMENTS, NO_MOMENTS
    if not has_faces or not _has_two_faces(grid, cells, normal):
        return moments_of_sums(whole), NO_MOMENTS
    nx, ny = normal
    before, behind = _face_sums(grid, cells, half, -nx, -ny), _face_sums(grid, cells, half, nx, ny)
    if min(before[0], behind[0]) >= minimum:
        return moments_of_sums(before), moments_of_sums(behind)
    if max(before[0], behind[0]) >= minimum:
        whole = before if before[0] >= minimum else behind
    return moments_of_sums(whole), NO_MOMENTS


@leaf_kernel
def _block_sums(grid: Grid, cells: Cells, half: float) -> tuple[Moments, tuple[float, float]]:
    """The sums of a block about the centre of its first cell, and the normal of the wall in it.

    For the normal each part counts about its own mean, so that the distance of two faces makes no difference.
    """
    sums = NO_MOMENTS
    xx = xy = yy = 0.0
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            if part[0] > 0.0:
                sums = plus_cell(sums, part, (at % 2) * half, (at // 2) * half)
                per_point = 1.0 / part[0]
                xx += part[3] - part[1] * part[1] * per_point
                xy += part[4] - part[1] * part[2] * per_point
                yy += part[5] - part[2] * part[2] * per_point
    return sums, _normal(long_axis_of((0.0, 0.0, 0.0, xx, xy, yy, 0.0, 0.0)))


@leaf_kernel
def _has_two_faces(grid: Grid, cells: Cells, normal: tuple[float, float]) -> bool:
    """Whether beams come from both sides of the wall."""
    number_before = number_behind = against = along = 0.0
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            through = part[6] * normal[0] + part[7] * normal[1]
            if through >= 0.0:
                number_behind += part[0]
                along += through
            else:
                number_before += part[0]
                against -= through
    share = grid.settings[SIDE_SHARE]
    return bool(against > share * number_before and along > share * number_behind)


@leaf_kernel
def _face_sums(grid: Grid, cells: Cells, half: float, nx: float, ny: float) -> Moments:
    """The sums of the parts of a block whose beams run along (nx, ny), about the centre of its first cell."""
    sums = NO_MOMENTS
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            if part[0] > 0.0 and part[6] * nx + part[7] * ny >= 0.0:
                sums = plus_cell(sums, part, (at % 2) * half, (at // 2) * half)
    return sums


@leaf_kernel
def plus_cell(sums: Moments, part: Array, dx: float, dy: float) -> Moments:
    """The sums plus those of a part whose cell has its centre at (dx, dy) from the reference point."""
    n, sx, sy, sxx, sxy, syy, fx, fy = sums
    return (
        n + part[0],
        sx + part[1] + part[0] * dx,
        sy + part[2] + part[0] * dy,
        sxx + part[3] + 2 * dx * part[1] + part[0] * dx * dx,
        sxy + part[4] + dx * part[2] + dy * part[1] + part[0] * dx * dy,
        syy + part[5] + 2 * dy * part[2] + part[0] * dy * dy,
        fx + part[6],
        fy + part[7],
    )


@leaf_kernel
def moments_of_sums(sums: Moments) -> Moments:
    """The moments of the points with these sums."""
    n, sx, sy, sxx, sxy, syy, fx, fy = sums
    if n == 0.0:
        return sums
    mx, my = sx / n, sy / n
    return n, mx, my, sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my, fx / n, fy / n


@leaf_kernel
def long_axis_of(moments: Moments) -> Direction:
    """The long axis of the covariance in the moments."""
    _, _, _, xx, xy, yy, _, _ = moments
    radius = eigenvalue_radius(xx, xy, yy)
    if radius > 0.0:
        return 0.5 * (xx - yy) / radius, xy / radius
    return 1.0, 0.0


@leaf_kernel
def eigenvalue_radius(xx: float, xy: float, yy: float) -> float:
    """Half of the difference between the eigenvalues of a covariance."""
    return float(np.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy))


@leaf_kernel
def _normal(long_axis: Direction) -> tuple[float, float]:
    """The unit vector perpendicular to the long axis, (cos ½β, sin ½β)."""
    c2, s2 = long_axis
    return -np.copysign(np.sqrt(max(0.5 - 0.5 * c2, 0.0)), s2), np.sqrt(max(0.5 + 0.5 * c2, 0.0))
