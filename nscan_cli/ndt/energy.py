"""The energy of points against Gaussians, its gradient and its Hessian ([19]; paper, III-F).

With x' = f_u(x), v = x' − q and s = exp(−½ w vᵗΣ⁻¹v), the energy is E(u) = −Σ s over all points and the four
Gaussians that each meets, but for those that its beam would hit from behind. `w` is 1 for the energy
itself; less widens every Gaussian by 1/√w, and with it the basin of convergence.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.compiled import kernel
from nscan_cli.ndt.grid import Ndt
from nscan_cli.ndt.table import Grid, find_row, pack
from nscan_cli.poses import Array

OUT = 10
"""Numbers that an evaluation gives: E, gradient (3), upper triangle of the Hessian (6)."""


@kernel
def accumulate(
    grid: Grid,
    half: float,
    points: Array,
    x: float,
    y: float,
    phi: float,
    widening: float,
    curvature: float,
    baseline: float,
    stride: int,
    out: Array,
) -> None:
    """Write E, gradient and Hessian at the pose u = (x, y, phi) of points (m, 2) into out (10,).

    With `curvature` 1 the Hessian is exact; with 0 its two terms that can be negative are left out, so
    that it is positive semi-definite everywhere. `baseline` is what every Gaussian that a point meets
    costs, well hit or not; it only counts when energies are compared. Of the points, every so-manyth
    counts by `stride`.
    """
    cos, sin = np.cos(phi), np.sin(phi)
    e = gx = gy = gp = hxx = hxy = hxp = hyy = hyp = hpp = 0.0
    for k in range(0, points.shape[0], stride):
        # R(φ) x, and x' = R(φ) x + t; ∂x'/∂φ = (−ry, rx), ∂²x'/∂φ² = −(rx, ry).
        rx = cos * points[k, 0] - sin * points[k, 1]
        ry = sin * points[k, 0] + cos * points[k, 1]
        px, py = rx + x, ry + y
        row = find_row(grid, pack(int(np.floor(px / half)), int(np.floor(py / half))))
        if row < 0:
            continue
        for block in range(4):
            link = grid.links[row, block]
            if link < 0:
                continue
            gaussian = grid.gaussians[link]
            if gaussian[2] == 0.0 or gaussian[5] * rx + gaussian[6] * ry > 0.0:
                continue
            vx, vy = px - gaussian[0], py - gaussian[1]
            ax, ay = gaussian[2] * vx + gaussian[3] * vy, gaussian[3] * vx + gaussian[4] * vy
            s = np.exp(-0.5 * widening * (vx * ax + vy * ay))
            ws = widening * s
            # vᵗΣ⁻¹ ∂x'/∂φ, and Σ⁻¹ ∂x'/∂φ.
            ap = ay * rx - ax * ry
            jx, jy = gaussian[3] * rx - gaussian[2] * ry, gaussian[4] * rx - gaussian[3] * ry
            cw = curvature * widening
            e -= s - baseline
            gx += ws * ax
            gy += ws * ay
            gp += ws * ap
            hxx += ws * (gaussian[2] - cw * ax * ax)
            hxy += ws * (gaussian[3] - cw * ax * ay)
            hyy += ws * (gaussian[4] - cw * ay * ay)
            hxp += ws * (jx - cw * ax * ap)
            hyp += ws * (jy - cw * ay * ap)
            hpp += ws * (jy * rx - jx * ry - curvature * (ax * rx + ay * ry) - cw * ap * ap)
    out[0], out[1], out[2], out[3] = e, gx, gy, gp
    out[4], out[5], out[6], out[7], out[8], out[9] = hxx, hxy, hxp, hyy, hyp, hpp


@kernel
def unpack(out: Array, scale: float, gradient: Array, hessian: Array) -> None:
    """Write gradient (3,) and Hessian (3, 3) of scale · E from the numbers (10,) of an evaluation."""
    index = 4
    for a in range(3):
        gradient[a] = scale * out[1 + a]
        for b in range(a, 3):
            hessian[a, b] = scale * out[index]
            hessian[b, a] = hessian[a, b]
            index += 1


@kernel
def inlier_share(grid: Grid, half: float, points: Array, pose: Array, bound: float) -> float:
    """The share of points (m, 2) within a Mahalanobis distance² of `bound` of some Gaussian."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    inliers = 0
    for k in range(points.shape[0]):
        rx = cos * points[k, 0] - sin * points[k, 1]
        ry = sin * points[k, 0] + cos * points[k, 1]
        px, py = rx + pose[0], ry + pose[1]
        row = find_row(grid, pack(int(np.floor(px / half)), int(np.floor(py / half))))
        if row < 0:
            continue
        for block in range(4):
            link = grid.links[row, block]
            if link < 0 or grid.gaussians[link, 2] == 0.0:
                continue
            gaussian = grid.gaussians[link]
            if gaussian[5] * rx + gaussian[6] * ry > 0.0:
                continue
            vx, vy = px - gaussian[0], py - gaussian[1]
            if gaussian[2] * vx * vx + 2 * gaussian[3] * vx * vy + gaussian[4] * vy * vy < bound:
                inliers += 1
                break
    return float(inliers / max(points.shape[0], 1))


class Energy(NamedTuple):
    """E with gradient (3,) and Hessian (3, 3) with respect to the pose (x, y, φ)."""

    value: float
    gradient: Array
    hessian: Array


def energy(ndt: Ndt, points: Array, pose: Array, widening: float = 1.0, exact: bool = True) -> Energy:
    """E_ij(u) of points (m, 2) of scan j at the pose u (3,) in the frame of the NDT of scan i.

    `exact=False` leaves the parts of the Hessian out that can be negative.
    """
    out = np.empty(OUT)
    x, y, phi = (float(part) for part in pose)
    accumulate(ndt.grid, ndt.half, points, x, y, phi, widening, float(exact), 0.0, 1, out)
    gradient, hessian = np.empty(3), np.empty((3, 3))
    unpack(out, 1.0, gradient, hessian)
    return Energy(float(out[0]), gradient, hessian)
