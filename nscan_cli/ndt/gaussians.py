"""One Gaussian of an NDT from the sums of its lattice cells ([19]).

One thing differs from [19]: the inverse of the larger eigenvalue λ is multiplied by the square of the ratio
of the smaller to the larger. A round Gaussian stays what it is; a piece of wall, long and thin, hardly holds
a point along itself. How points are spread along a wall says where the beams fell, not where the wall is:
taken at its word, it drags the robot back in corridors, and the Hessian claims to know the way along.

Another thing is added: a Gaussian knows from which side it was seen. A wall that is seen from a room and
from the corridor has two faces, 10 or 15 cm apart; matched with each other they pull the scans together by
that much, and one Gaussian made of both pulls them into the wall. The points of a block are therefore parted
by the side that their beams come from, each makes a Gaussian of its own, and a beam meets the one whose face
it hits.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import leaf_kernel, llvm_inline_kernel
from nscan_cli.ndt.hash_grid import FACES, FLOOR, HALF_KEY, MINIMUM, Grid, find_row, unpack
from nscan_cli.poses import Array

Cells = tuple[int | np.int32, int, int, int]
"""Rows of the four lattice cells of a block, or −1."""
Moments = tuple[float, float, float, float, float, float, float, float]
"""Number of points, their mean (x, y), covariance (xx, xy, yy), and the mean unit vector along the beams; or,
before they are divided by the number, the sums."""
Direction = tuple[float, float]
"""Cosine and sine of twice the angle of a covariance's long axis."""
NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The moments of no points."""
ONE_SIDED = 0.2
"""A Gaussian shows one side when its beams run through it by so much of their length on average."""


@leaf_kernel
def make_gaussian(grid: Grid, row: int, half: float) -> None:
    """Mean, inverse covariance and side of the block of four lattice cells whose lower left one is `row`.

    Two of them where the grid has faces, and the points lie on two faces of a wall.
    """
    key, gaussian, other = grid.keys[row], grid.gaussians[row], grid.keys.shape[0] + row
    if gaussian[7] > 0.0:
        grid.gaussians[other, 2] = 0.0
    gaussian[:] = 0.0
    front, back = faces(grid, row, half)
    if front[0] > 0.0:
        shape(grid, key, front, long_axis_of(front), half, gaussian)
    if back[0] > 0.0:
        gaussian[7] = other
        shape(grid, key, back, long_axis_of(back), half, grid.gaussians[other])


@llvm_inline_kernel
def shape(grid: Grid, key: int, moments: Moments, long_axis: Direction, half: float, gaussian: Array) -> None:
    """Write the numbers of the Gaussian with some moments about the centre of the cell of `key`."""
    (_, mx, my, _, _, _, fx, fy), (c2, s2) = moments, long_axis
    small, large = eigenvalues(grid, moments)
    along = small * small / (large * large * large)
    mean, half_gap = 0.5 * (along + 1 / small), 0.5 * (along - 1 / small)
    ix, iy = unpack(key)
    gaussian[0] = (ix + 0.5) * half + mx
    gaussian[1] = (iy + 0.5) * half + my
    gaussian[2] = mean + half_gap * c2
    gaussian[3] = half_gap * s2
    gaussian[4] = mean - half_gap * c2
    nx, ny = _normal(long_axis)
    through = fx * nx + fy * ny
    gaussian[5] = gaussian[6] = 0.0
    if abs(through) > ONE_SIDED:
        side = -1.0 if through > 0.0 else 1.0
        gaussian[5], gaussian[6] = side * nx, side * ny


@leaf_kernel
def eigenvalues(grid: Grid, moments: Moments) -> tuple[float, float]:
    """Of a covariance, the smaller one first; both at least the floor, it 0.001 of the larger ([19])."""
    _, _, _, xx, xy, yy, _, _ = moments
    middle, radius, floor = 0.5 * (xx + yy), radius_of(xx, xy, yy), grid.making[FLOOR]
    large = max(middle + radius, floor * floor)
    return max(middle - radius, floor * floor, 0.001 * large), large


@llvm_inline_kernel
def faces(grid: Grid, row: int, half: float) -> tuple[Moments, Moments]:
    """Of the points of the block of `row`, and of those that lie on another face of the wall there.

    Nothing where there are too few.
    """
    cells = _cells(grid, grid.keys[row], row)
    minimum, has_faces = grid.making[MINIMUM], grid.making[FACES] > 0.0
    whole, normal = _block(grid, cells, half)
    if whole[0] < minimum:
        return NOTHING, NOTHING
    if not has_faces or not _are_two(grid, cells, normal):
        return divided(whole), NOTHING
    nx, ny = normal
    before, behind = _face(grid, cells, half, -nx, -ny), _face(grid, cells, half, nx, ny)
    if min(before[0], behind[0]) >= minimum:
        return divided(before), divided(behind)
    if max(before[0], behind[0]) >= minimum:
        whole = before if before[0] >= minimum else behind
    return divided(whole), NOTHING


@leaf_kernel
def _block(grid: Grid, cells: Cells, half: float) -> tuple[Moments, tuple[float, float]]:
    """The sums of a block from the centre of its first cell, and the normal of what is in its cells.

    The latter of each part about its own mean: without what is between two faces.
    """
    sums = NOTHING
    xx = xy = yy = 0.0
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            if part[0] > 0.0:
                sums = plus(sums, part, (at % 2) * half, (at // 2) * half)
                per_point = 1.0 / part[0]
                xx += part[3] - part[1] * part[1] * per_point
                xy += part[4] - part[1] * part[2] * per_point
                yy += part[5] - part[2] * part[2] * per_point
    return sums, _normal(_doubled(xx, xy, yy))


@leaf_kernel
def _are_two(grid: Grid, cells: Cells, normal: tuple[float, float]) -> bool:
    """Whether the beams come from both sides."""
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
    return against > ONE_SIDED * number_before and along > ONE_SIDED * number_behind


@leaf_kernel
def _face(grid: Grid, cells: Cells, half: float, nx: float, ny: float) -> Moments:
    """The sums of the parts of a block whose beams run along (nx, ny), from the centre of its first cell."""
    sums = NOTHING
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            if part[0] > 0.0 and part[6] * nx + part[7] * ny >= 0.0:
                sums = plus(sums, part, (at % 2) * half, (at // 2) * half)
    return sums


@leaf_kernel
def _cells(grid: Grid, key: int, row: int) -> Cells:
    """Those of the block whose lower left cell is `row`."""
    return (
        np.int32(row),
        find_row(grid, key + 2 * HALF_KEY),
        find_row(grid, key + 1),
        find_row(grid, key + 2 * HALF_KEY + 1),
    )


@leaf_kernel
def plus(sums: Moments, part: Array, dx: float, dy: float) -> Moments:
    """The sums with a part, whose cell's centre is (dx, dy) off the point that they are about."""
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
def divided(sums: Moments) -> Moments:
    """The moments of which these are the sums."""
    n, sx, sy, sxx, sxy, syy, fx, fy = sums
    if n == 0.0:
        return sums
    mx, my = sx / n, sy / n
    return n, mx, my, sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my, fx / n, fy / n


@leaf_kernel
def long_axis_of(moments: Moments) -> Direction:
    """That of the moments."""
    _, _, _, xx, xy, yy, _, _ = moments
    return _doubled(xx, xy, yy)


@leaf_kernel
def _doubled(xx: float, xy: float, yy: float) -> Direction:
    """That of a covariance."""
    radius = radius_of(xx, xy, yy)
    if radius > 0.0:
        return 0.5 * (xx - yy) / radius, xy / radius
    return 1.0, 0.0


@leaf_kernel
def radius_of(xx: float, xy: float, yy: float) -> float:
    """Half of what the eigenvalues of a covariance differ by."""
    return float(np.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy))


@leaf_kernel
def _normal(long_axis: Direction) -> tuple[float, float]:
    """The unit vector at a right angle to the long axis, (cos ½β, sin ½β)."""
    c2, s2 = long_axis
    return -np.copysign(np.sqrt(max(0.5 - 0.5 * c2, 0.0)), s2), np.sqrt(max(0.5 + 0.5 * c2, 0.0))
