"""One Gaussian of an NDT from the sums of its lattice cells ([19]).

One thing differs from [19]: the inverse of the larger eigenvalue λ is multiplied by a power of the ratio of
the smaller to the larger. A round Gaussian stays what it is; a piece of wall, long and thin, hardly holds a
point along itself. How points are spread along a wall says where the beams fell, not where the wall is:
taken at its word, it drags the robot back in corridors, and the Hessian claims to know the way along.

Another thing is added: a Gaussian knows from which side it was seen. A wall that is seen from a room and
from the corridor has two faces, 10 or 15 cm apart; matched with each other they pull the scans together by
that much. A beam that hits a Gaussian from behind therefore does not meet it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.compiled import lean_kernel
from nscan_cli.ndt.table import HALF_KEY, Grid, find_row

ONE_SIDED = 0.2
"""A Gaussian shows one side when its beams run through it by so much of their length on average."""
THIN = 10.0
"""A Gaussian is a piece of wall when its larger eigenvalue is so many times the smaller one."""
SAME_DIRECTION = 0.9
"""Cosine of twice the angle by which the direction from a larger block may differ."""


@lean_kernel
def make_gaussian(grid: Grid, row: int, half: float, minimum: float, floor: float, straight: bool) -> None:
    """Mean, inverse covariance and side of the block of four lattice cells whose lower left one is `row`.

    With `straight` a piece of wall takes its direction from the block of twice the size around it, where
    the points there lie as flat as its own, and holds points along itself still less. A direction that is
    off by the noise of its few points tells a way along the wall that nobody knows, and eight times less
    from twice the length. It takes neighbours that are there before the Gaussian is made.
    """
    key = grid.keys[row]
    n, mx, my, xx, xy, yy, fx, fy = _moments(grid, key, 0, 2, half)
    gaussian = grid.gaussians[row]
    if n < minimum:
        gaussian[:] = 0.0
        return
    # Eigenvalues of the 2 × 2 covariance; both are raised to the floor.
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    large = max(middle + radius, floor * floor)
    small = max(middle - radius, floor * floor, 0.001 * large)
    c2, s2 = _doubled(xx, xy, yy, radius)
    along = small / (large * large)
    if straight:
        along *= small / large
        if large > THIN * small:
            for around in (2, 1):
                _, _, _, xx, xy, yy, _, _ = _moments(grid, key, -around, 2 + around, half)
                middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
                wide_c2, wide_s2 = _doubled(xx, xy, yy, radius)
                if middle - radius < small and wide_c2 * c2 + wide_s2 * s2 > SAME_DIRECTION:
                    c2, s2 = wide_c2, wide_s2
                    break
    mean, half_gap = 0.5 * (along + 1 / small), 0.5 * (along - 1 / small)
    ix, iy = key // (2 * HALF_KEY) - HALF_KEY, key % (2 * HALF_KEY) - HALF_KEY
    gaussian[0] = (ix + 0.5) * half + mx
    gaussian[1] = (iy + 0.5) * half + my
    gaussian[2] = mean + half_gap * c2
    gaussian[3] = half_gap * s2
    gaussian[4] = mean - half_gap * c2
    # The normal is the eigenvector of the smaller eigenvalue, at a right angle to (cos ½β, sin ½β).
    nx, ny = -np.copysign(np.sqrt(max(0.5 - 0.5 * c2, 0.0)), s2), np.sqrt(max(0.5 + 0.5 * c2, 0.0))
    through = fx * nx + fy * ny
    gaussian[5] = gaussian[6] = 0.0
    if abs(through) > ONE_SIDED:
        side = -1.0 if through > 0.0 else 1.0
        gaussian[5], gaussian[6] = side * nx, side * ny


@lean_kernel
def _moments(
    grid: Grid, key: int, first: int, end: int, half: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Of the lattice cells from `first` to `end` about that of `key`, relative to the latter's centre.

    Number of points, their mean (x, y), covariance (xx, xy, yy), and the mean unit vector along the beams.
    """
    n = sx = sy = sxx = sxy = syy = fx = fy = 0.0
    for oy in range(first, end):
        for ox in range(first, end):
            cell = find_row(grid, key + ox * 2 * HALF_KEY + oy)
            if cell < 0 or grid.sums[cell, 0] == 0.0:
                continue
            part = grid.sums[cell]
            # The sums move from the cell's own centre to that of cell 0.
            dx, dy = ox * half, oy * half
            n += part[0]
            sx += part[1] + part[0] * dx
            sy += part[2] + part[0] * dy
            sxx += part[3] + 2 * dx * part[1] + part[0] * dx * dx
            sxy += part[4] + dx * part[2] + dy * part[1] + part[0] * dx * dy
            syy += part[5] + 2 * dy * part[2] + part[0] * dy * dy
            fx += part[6]
            fy += part[7]
    if n == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    mx, my = sx / n, sy / n
    return n, mx, my, sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my, fx / n, fy / n


@lean_kernel
def _doubled(xx: float, xy: float, yy: float, radius: float) -> tuple[float, float]:
    """Cosine and sine of twice the angle of a covariance's long axis."""
    if radius > 0.0:
        return 0.5 * (xx - yy) / radius, xy / radius
    return 1.0, 0.0
