"""The energy of points against Gaussians, its gradient and its Hessian ([19]; paper, III-F).

With x' = f_u(x), v = x' − q and s = exp(−½ w vᵗΣ⁻¹v), the energy is E(u) = −Σ s over all points and the four
Gaussians that each is associated with, except those that its beam would hit from behind. `w` is 1 for the
energy itself; a smaller value widens every Gaussian by 1/√w, and with it the basin of convergence.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel, reduction_kernel
from nscan_cli.ndt.association import (
    BLOCKS,
    Association,
    AssociationBuffers,
    associate_once,
    association_buffers,
)
from nscan_cli.ndt.hash_grid import Grid, facing_gaussian, find_row, pack_key
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Mask

Vector = tuple[float, float]
Symmetric = tuple[float, float, float]
Terms = tuple[float, float, float, float, float, float, float, float, float, float]

ENERGY_NUMBERS = 10
"""Numbers of an evaluation: E, gradient (3), upper triangle of the Hessian (6)."""
LEAST_EXPONENT = -700.0
"""Lower bound of the exponent of s; the exponential of it is 10⁻³⁰⁴."""
LOG2_E = 1.4426950408889634
"""log₂ e"""
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
"""ln 2 in two parts. The first one times a whole number is exact."""


@leaf_kernel
def evaluate_energy(
    grid: Grid,
    half: float,
    points: Array,
    pose: Array,
    widening: float,
    curvature: float,
    baseline: float,
    stride: int,
    buffers: AssociationBuffers,
    out: Array,
) -> None:
    """Write E, gradient and Hessian at the pose u (3,) of points (m, 2) into out (10,).

    With `curvature` 1 the Hessian is exact. With 0 it lacks the two terms that can be negative, so that it is
    positive semi-definite everywhere. Every pair of a point and a Gaussian adds `baseline` to E. Of the
    points, one in `stride` counts.
    """
    count = associate_once(grid, half, points, pose, stride, buffers)
    _sum_pairs(buffers.pairs, count, widening, curvature, baseline, out)


@reduction_kernel
def _sum_pairs(
    pairs: Array, count: int, widening: float, curvature: float, baseline: float, out: Array
) -> None:
    """Write E, gradient and Hessian of `count` pairs into out (10,).

    The loop has no branch and no call, so that the processor evaluates several pairs at a time.
    """
    e = gx = gy = gp = hxx = hxy = hxp = hyy = hyp = hpp = 0.0
    for k in range(count):
        v, sigma = (pairs[2, k], pairs[3, k]), (pairs[4, k], pairs[5, k], pairs[6, k])
        t = _pair_terms(pairs[0, k], pairs[1, k], v, sigma, 1.0, widening, curvature)
        e += baseline - t[0]
        gx, gy, gp = gx + t[1], gy + t[2], gp + t[3]
        hxx, hxy, hxp, hyy, hyp, hpp = hxx + t[4], hxy + t[5], hxp + t[6], hyy + t[7], hyp + t[8], hpp + t[9]
    out[0], out[1], out[2], out[3] = e, gx, gy, gp
    out[4], out[5], out[6], out[7], out[8], out[9] = hxx, hxy, hxp, hyy, hyp, hpp


@reduction_kernel
def sum_association(association: Association, widening: float, curvature: float, out: Array) -> None:
    """Write E, gradient and Hessian of an association into out (10,), as `evaluate_energy` does."""
    moved, gaussians = association.moved, association.gaussians
    e = gx = gy = gp = hxx = hxy = hxp = hyy = hyp = hpp = 0.0
    for block in range(BLOCKS):
        for k in range(moved.shape[1]):
            rx, ry = moved[0, k], moved[1, k]
            v = moved[2, k] - gaussians[block, 0, k], moved[3, k] - gaussians[block, 1, k]
            sigma = gaussians[block, 2, k], gaussians[block, 3, k], gaussians[block, 4, k]
            faces = gaussians[block, 5, k] * rx + gaussians[block, 6, k] * ry <= 0.0
            # `&` is no branch, unlike `and`.
            t = _pair_terms(rx, ry, v, sigma, 1.0 if faces & (sigma[0] > 0.0) else 0.0, widening, curvature)
            e -= t[0]
            gx, gy, gp = gx + t[1], gy + t[2], gp + t[3]
            hxx, hxy, hxp = hxx + t[4], hxy + t[5], hxp + t[6]
            hyy, hyp, hpp = hyy + t[7], hyp + t[8], hpp + t[9]
    out[0], out[1], out[2], out[3] = e, gx, gy, gp
    out[4], out[5], out[6], out[7], out[8], out[9] = hxx, hxy, hxp, hyy, hyp, hpp


@reduction_kernel
def _pair_terms(
    rx: float, ry: float, v: Vector, sigma: Symmetric, weight: float, widening: float, curvature: float
) -> Terms:
    """s, gradient and Hessian of a pair of a point and a Gaussian, times its weight."""
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
    """eᵗ for −700 ≤ t ≤ 0 to a relative error of 10⁻¹⁴: 2ⁿ eʳ with |r| ≤ ½ ln 2, and eʳ by its series."""
    n = np.floor(t * LOG2_E + 0.5)
    r = t - n * LN2_HIGH - n * LN2_LOW
    tail = 1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800))))
    series = 1 + r * (1 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * tail))))))
    # 2ⁿ from its bits: the exponent is above the 52 bits of the fraction.
    return float(series * np.int64((np.int64(n) + 1023) << 52).view(np.float64))


@leaf_kernel
def unpack_derivatives(out: Array, scale: float, gradient: Array, hessian: Array) -> None:
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
def find_inliers(grid: Grid, half: float, points: Array, pose: Array, bound: float, inliers: Mask) -> int:
    """Mark the points (m, 2) within a Mahalanobis distance² of `bound` of some Gaussian in `inliers` (m,).

    Returns their number. Other marks stay.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    count, row, key = 0, -1, -1
    for k in range(points.shape[0]):
        rx = cos * points[k, 0] - sin * points[k, 1]
        ry = sin * points[k, 0] + cos * points[k, 1]
        px, py = rx + pose[0], ry + pose[1]
        cell = pack_key(int(np.floor(px / half)), int(np.floor(py / half)))
        if cell != key:
            key, row = cell, find_row(grid, cell)
        if row < 0:
            continue
        for block in range(BLOCKS):
            link = facing_gaussian(grid, grid.links[row, block], rx, ry)
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
    """An energy of n poses (x, y, φ) with its derivatives."""

    value: float
    gradient: Array
    """(3n,)"""
    hessian: Array
    """(3n, 3n)"""


def energy(ndt: Ndt, points: Array, pose: Array, widening: float = 1.0, exact: bool = True) -> Energy:
    """E_ij(u) of the points (m, 2) of scan j at the pose u (3,) in the frame of the NDT of scan i.

    Of the Hessian, `exact=False` leaves out the parts that can be negative.
    """
    out = np.empty(ENERGY_NUMBERS)
    buffers = association_buffers(len(points), 1)
    at = np.asarray(pose, dtype=np.float64)
    evaluate_energy(ndt.grid, ndt.half, points, at, widening, float(exact), 0.0, 1, buffers, out)
    gradient, hessian = np.empty(3), np.empty((3, 3))
    unpack_derivatives(out, 1.0, gradient, hessian)
    return Energy(float(out[0]), gradient, hessian)
