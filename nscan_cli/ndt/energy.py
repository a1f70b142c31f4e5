"""The energy of points against Gaussians, its gradient and its Hessian ([19]; paper, III-F).

With x' = f_u(x), v = x' − q and s = exp(−½ w vᵗΣ⁻¹v), the energy is E(u) = −Σ s over all points and the four
Gaussians that each meets, but for those that its beam would hit from behind. `w` is 1 for the energy
itself; less widens every Gaussian by 1/√w, and with it the basin of convergence.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel, reduction_kernel
from nscan_cli.ndt.association import BLOCKS, Association, RoomToMeet, associate, room_to_meet
from nscan_cli.ndt.hash_grid import Grid, find_row, pack, shown
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array

Vector = tuple[float, float]
Symmetric = tuple[float, float, float]
Terms = tuple[float, float, float, float, float, float, float, float, float, float]

OUT = 10
"""Numbers that an evaluation gives: E, gradient (3), upper triangle of the Hessian (6)."""
LEAST_EXPONENT = -700.0
"""So far away a point counts 10⁻³⁰⁴."""
LOG2_E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
"""ln 2 in two parts, of which the first times a whole number is exact."""


@leaf_kernel
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
    room: RoomToMeet,
    out: Array,
) -> None:
    """Write E, gradient and Hessian at the pose u = (x, y, phi) of points (m, 2) into out (10,).

    With `curvature` 1 the Hessian is exact; with 0 its two terms that can be negative are left out, so
    that it is positive semi-definite everywhere. `baseline` is what every Gaussian that a point meets
    costs, well hit or not; it only counts when energies are compared. Of the points, every so-manyth
    counts by `stride`. `room` is to work in.
    """
    count = associate(grid, half, points, x, y, phi, stride, room)
    _sum(room.met, count, widening, curvature, baseline, out)


@reduction_kernel
def _sum(met: Array, count: int, widening: float, curvature: float, baseline: float, out: Array) -> None:
    """Write E, gradient and Hessian of `count` points on Gaussians into out (10,).

    There is no branch in the loop and no call, so that the processor takes several points at a time.
    """
    e = gx = gy = gp = hxx = hxy = hxp = hyy = hyp = hpp = 0.0
    for k in range(count):
        v, sigma = (met[2, k], met[3, k]), (met[4, k], met[5, k], met[6, k])
        t = _terms(met[0, k], met[1, k], v, sigma, 1.0, widening, curvature)
        e += baseline - t[0]
        gx, gy, gp = gx + t[1], gy + t[2], gp + t[3]
        hxx, hxy, hxp, hyy, hyp, hpp = hxx + t[4], hxy + t[5], hxp + t[6], hyy + t[7], hyp + t[8], hpp + t[9]
    out[0], out[1], out[2], out[3] = e, gx, gy, gp
    out[4], out[5], out[6], out[7], out[8], out[9] = hxx, hxy, hxp, hyy, hyp, hpp


@reduction_kernel
def sum_meeting(meeting: Association, widening: float, curvature: float, out: Array) -> None:
    """Write E, gradient and Hessian of the points of a meeting into out (10,), as `accumulate` does."""
    moved, gaussians = meeting.moved, meeting.gaussians
    e = gx = gy = gp = hxx = hxy = hxp = hyy = hyp = hpp = 0.0
    for block in range(BLOCKS):
        for k in range(moved.shape[1]):
            rx, ry = moved[0, k], moved[1, k]
            v = moved[2, k] - gaussians[block, 0, k], moved[3, k] - gaussians[block, 1, k]
            sigma = gaussians[block, 2, k], gaussians[block, 3, k], gaussians[block, 4, k]
            shows = gaussians[block, 5, k] * rx + gaussians[block, 6, k] * ry <= 0.0
            # Without `and`, which would be a branch.
            t = _terms(rx, ry, v, sigma, 1.0 if shows & (sigma[0] > 0.0) else 0.0, widening, curvature)
            e -= t[0]
            gx, gy, gp = gx + t[1], gy + t[2], gp + t[3]
            hxx, hxy, hxp, hyy, hyp, hpp = (
                hxx + t[4],
                hxy + t[5],
                hxp + t[6],
                hyy + t[7],
                hyp + t[8],
                hpp + t[9],
            )
    out[0], out[1], out[2], out[3] = e, gx, gy, gp
    out[4], out[5], out[6], out[7], out[8], out[9] = hxx, hxy, hxp, hyy, hyp, hpp


@reduction_kernel
def _terms(
    rx: float, ry: float, v: Vector, sigma: Symmetric, weight: float, widening: float, curvature: float
) -> Terms:
    """The s, gradient and Hessian of a point on a Gaussian, times its weight."""
    (vx, vy), (xx, xy, yy) = v, sigma
    cw = curvature * widening
    # Σ⁻¹v; vᵗΣ⁻¹ ∂x'/∂φ and Σ⁻¹ ∂x'/∂φ, with ∂x'/∂φ = (−ry, rx) and ∂²x'/∂φ² = −(rx, ry).
    ax, ay = xx * vx + xy * vy, xy * vx + yy * vy
    ap = ay * rx - ax * ry
    jx, jy = xy * rx - xx * ry, yy * rx - xy * ry
    s = weight * _exp(max(-0.5 * widening * (vx * ax + vy * ay), LEAST_EXPONENT))
    ws = widening * s
    return (
        s,
        ws * ax,
        ws * ay,
        ws * ap,
        ws * (xx - cw * ax * ax),
        ws * (xy - cw * ax * ay),
        ws * (jx - cw * ax * ap),
        ws * (yy - cw * ay * ay),
        ws * (jy - cw * ay * ap),
        ws * (jy * rx - jx * ry - curvature * (ax * rx + ay * ry) - cw * ap * ap),
    )


@leaf_kernel
def _exp(t: float) -> float:
    """eᵗ for −700 ≤ t ≤ 0, to 10⁻¹⁴ of it: 2ⁿ eʳ with |r| ≤ ½ ln 2, and eʳ by its series."""
    n = np.floor(t * LOG2_E + 0.5)
    r = t - n * LN2_HIGH - n * LN2_LOW
    tail = 1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800))))
    series = 1 + r * (1 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * tail))))))
    # 2ⁿ by its bits: the exponent stands above the 52 of the fraction.
    return float(series * np.int64((np.int64(n) + 1023) << 52).view(np.float64))


@leaf_kernel
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
    inliers = np.zeros(points.shape[0], dtype=np.bool_)
    return float(find_inliers(grid, half, points, pose, bound, inliers) / max(points.shape[0], 1))


@leaf_kernel
def find_inliers(
    grid: Grid, half: float, points: Array, pose: Array, bound: float, inliers: NDArray[np.bool_]
) -> int:
    """Mark the points (m, 2) within a Mahalanobis distance² of `bound` of some Gaussian in `inliers` (m,).

    How many they are; other marks are left as they were.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    count, row, key = 0, -1, -1
    for k in range(points.shape[0]):
        rx = cos * points[k, 0] - sin * points[k, 1]
        ry = sin * points[k, 0] + cos * points[k, 1]
        px, py = rx + pose[0], ry + pose[1]
        cell = pack(int(np.floor(px / half)), int(np.floor(py / half)))
        if cell != key:
            key, row = cell, find_row(grid, cell)
        if row < 0:
            continue
        for block in range(4):
            link = shown(grid, grid.links[row, block], rx, ry)
            if link < 0:
                continue
            gaussian = grid.gaussians[link]
            vx, vy = px - gaussian[0], py - gaussian[1]
            if gaussian[2] * vx * vx + 2 * gaussian[3] * vx * vy + gaussian[4] * vy * vy < bound:
                inliers[k] = True
                count += 1
                break
    return count


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
    room = room_to_meet(len(points), 1)
    accumulate(ndt.grid, ndt.half, points, x, y, phi, widening, float(exact), 0.0, 1, room, out)
    gradient, hessian = np.empty(3), np.empty((3, 3))
    unpack(out, 1.0, gradient, hessian)
    return Energy(float(out[0]), gradient, hessian)
