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

from nscan_cli.compiled import lean_kernel
from nscan_cli.ndt.table import HALF_KEY, Grid, find_row, unpack
from nscan_cli.poses import Array

Cells = tuple[int, int, int, int]
"""Rows of the four lattice cells of a block, or −1."""
Moments = tuple[float, float, float, float, float, float, float, float]
"""Number of points, their mean (x, y), covariance (xx, xy, yy), and the mean unit vector along the beams; or,
before they are divided by the number, the sums."""
NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The moments of no points."""
ONE_SIDED = 0.2
"""A Gaussian shows one side when its beams run through it by so much of their length on average."""
THIN = 10.0
"""A Gaussian is a piece of wall when its larger eigenvalue is so many times the smaller one."""
SAME_DIRECTION = 0.9
"""Cosine of twice the angle by which the direction from a larger block may differ."""


@lean_kernel
def make_gaussian(
    grid: Grid, row: int, half: float, minimum: float, floor: float, straight: bool, faces: bool
) -> None:
    """Mean, inverse covariance and side of the block of four lattice cells whose lower left one is `row`.

    With `faces` two of them, where the points lie on two faces of a wall. With `straight` a piece of wall
    takes its direction from the block of twice the size around it, where the points there lie as flat as its
    own. A direction that is off by the noise of its few points tells a way along the wall that nobody knows,
    and eight times less from twice the length. It takes neighbours that are there before the Gaussian is
    made.
    """
    key, gaussian, other = grid.keys[row], grid.gaussians[row], grid.keys.shape[0] + row
    if gaussian[7] > 0.0:
        grid.gaussians[other, 2] = 0.0
    gaussian[:] = 0.0
    cells = _cells(grid, key, row)
    whole = _block(grid, cells, half, 0.0, 0.0)
    if whole[0] < minimum:
        return
    before, behind = _two_faces(grid, cells, half) if faces else (NOTHING, NOTHING)
    if min(before[0], behind[0]) >= minimum:
        gaussian[7] = other
        _shape(grid, key, behind, half, floor, straight, grid.gaussians[other])
    if max(before[0], behind[0]) >= minimum:
        whole = before if before[0] >= minimum else behind
    _shape(grid, key, whole, half, floor, straight, gaussian)


@lean_kernel
def _shape(
    grid: Grid, key: int, moments: Moments, half: float, floor: float, straight: bool, gaussian: Array
) -> None:
    """Write the numbers of the Gaussian with some moments about the centre of the cell of `key`."""
    _, mx, my, xx, xy, yy, fx, fy = moments
    # Eigenvalues of the 2 × 2 covariance; both are raised to the floor.
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    large = max(middle + radius, floor * floor)
    small = max(middle - radius, floor * floor, 0.001 * large)
    c2, s2 = _doubled(xx, xy, yy, radius)
    nx, ny = _normal(moments)
    along = small * small / (large * large * large)
    if straight and large > THIN * small:
        for around in (2, 1):
            wide = _around(grid, key, around, half)
            _, _, _, xx, xy, yy, _, _ = wide
            middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
            wide_c2, wide_s2 = _doubled(xx, xy, yy, radius)
            if middle - radius < small and wide_c2 * c2 + wide_s2 * s2 > SAME_DIRECTION:
                c2, s2 = wide_c2, wide_s2
                nx, ny = _normal(wide)
                break
    mean, half_gap = 0.5 * (along + 1 / small), 0.5 * (along - 1 / small)
    ix, iy = unpack(key)
    gaussian[0] = (ix + 0.5) * half + mx
    gaussian[1] = (iy + 0.5) * half + my
    gaussian[2] = mean + half_gap * c2
    gaussian[3] = half_gap * s2
    gaussian[4] = mean - half_gap * c2
    through = fx * nx + fy * ny
    gaussian[5] = gaussian[6] = 0.0
    if abs(through) > ONE_SIDED:
        side = -1.0 if through > 0.0 else 1.0
        gaussian[5], gaussian[6] = side * nx, side * ny


@lean_kernel
def _two_faces(grid: Grid, cells: Cells, half: float) -> tuple[Moments, Moments]:
    """Of the points on one face of a wall, and of those on the other; nothing where there are not two."""
    nx, ny = _normal(_within(grid, cells))
    # Mostly all beams come from one side: that is seen before any moments are summed.
    number_before = number_behind = against = along = 0.0
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            through = part[6] * nx + part[7] * ny
            if through >= 0.0:
                number_behind += part[0]
                along += through
            else:
                number_before += part[0]
                against -= through
    if against > ONE_SIDED * number_before and along > ONE_SIDED * number_behind:
        return _block(grid, cells, half, -nx, -ny), _block(grid, cells, half, nx, ny)
    return NOTHING, NOTHING


@lean_kernel
def _cells(grid: Grid, key: int, row: int) -> Cells:
    """Those of the block whose lower left cell is `row`."""
    return (
        row,
        find_row(grid, key + 2 * HALF_KEY),
        find_row(grid, key + 1),
        find_row(grid, key + 2 * HALF_KEY + 1),
    )


@lean_kernel
def _block(grid: Grid, cells: Cells, half: float, nx: float, ny: float) -> Moments:
    """Of a block, from the centre of its first cell; only of the parts whose beams run along (nx, ny)."""
    sums = NOTHING
    for at in range(4):
        if cells[at] < 0:
            continue
        for side in range(2):
            part = grid.sums[cells[at], side]
            if part[0] > 0.0 and part[6] * nx + part[7] * ny >= 0.0:
                sums = _plus(sums, part, (at % 2) * half, (at // 2) * half)
    return _divided(sums)


@lean_kernel
def _within(grid: Grid, cells: Cells) -> Moments:
    """Of the parts of a block's lattice cells, each about its own mean: without what is between two faces."""
    n = xx = xy = yy = 0.0
    for at in range(4):
        for side in range(2 if cells[at] >= 0 else 0):
            part = grid.sums[cells[at], side]
            if part[0] > 0.0:
                n += part[0]
                xx += part[3] - part[1] * part[1] / part[0]
                xy += part[4] - part[1] * part[2] / part[0]
                yy += part[5] - part[2] * part[2] / part[0]
    return n, 0.0, 0.0, xx, xy, yy, 0.0, 0.0


@lean_kernel
def _around(grid: Grid, key: int, around: int, half: float) -> Moments:
    """Of a block and so many lattice cells around it, from the centre of the cell of `key`."""
    sums = NOTHING
    for oy in range(-around, 2 + around):
        for ox in range(-around, 2 + around):
            cell = find_row(grid, key + ox * 2 * HALF_KEY + oy)
            for side in range(2 if cell >= 0 else 0):
                sums = _plus(sums, grid.sums[cell, side], ox * half, oy * half)
    return _divided(sums)


@lean_kernel
def _plus(sums: Moments, part: Array, dx: float, dy: float) -> Moments:
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


@lean_kernel
def _divided(sums: Moments) -> Moments:
    """The moments of which these are the sums."""
    n, sx, sy, sxx, sxy, syy, fx, fy = sums
    if n == 0.0:
        return sums
    mx, my = sx / n, sy / n
    return n, mx, my, sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my, fx / n, fy / n


@lean_kernel
def _normal(moments: Moments) -> tuple[float, float]:
    """The unit eigenvector of a covariance's smaller eigenvalue."""
    _, _, _, xx, xy, yy, _, _ = moments
    c2, s2 = _doubled(xx, xy, yy, np.hypot(0.5 * (xx - yy), xy))
    # At a right angle to the long axis, (cos ½β, sin ½β).
    return -np.copysign(np.sqrt(max(0.5 - 0.5 * c2, 0.0)), s2), np.sqrt(max(0.5 + 0.5 * c2, 0.0))


@lean_kernel
def _doubled(xx: float, xy: float, yy: float, radius: float) -> tuple[float, float]:
    """Cosine and sine of twice the angle of a covariance's long axis."""
    if radius > 0.0:
        return 0.5 * (xx - yy) / radius, xy / radius
    return 1.0, 0.0
