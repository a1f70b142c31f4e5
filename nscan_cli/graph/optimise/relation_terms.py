"""The terms of a graph's energy with exact derivatives (paper, IV, eqs. (18) to (25)).

Every relation gives fᵗHf, eq. (23), without a factor ½. A pairwise relation is one of two poses
(graph/relations/pairwise.py).
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array


@kernel
def nscan_term(
    poses: Array,
    local: Array,
    information: Array,
    fixed: int,
    curvature: float,
    gradient: Array,
    hessian: Array,
) -> float:
    """fᵗHf, eq. (23); writes its gradient (3n,), (24), and Hessian (3n, 3n), (25); f is (19) to (22).

    poses (n, 3) are global. Pose c, c = `fixed`, only defines the mapping: its own f is 0. `curvature` 1
    gives the exact Hessian, 0 leaves out the term in ∂²f (Gauss–Newton).

    With d_i = t̂_i − t̂_c and the rotation R by θ = φ_c − φ̂_c, f_i = (R d_i, φ̂_i + θ) minus a constant. So
    ∂f_i/∂x̂_i = R and ∂f_i/∂x̂_c = R A_i, A_i = [[−1, 0, d_y], [0, −1, −d_x], [0, 0, −1]]: with H and Hf
    rotated back into the global frame, only pose c needs products, and these are sums.
    """
    n, c = poses.shape[0], fixed
    d, f = np.empty((n, 2)), np.empty(3 * n)
    cos, sin = _residual(poses, local, c, d, f)

    value, k = 0.0, 3 * c
    for a in range(k, k + 3):
        gradient[a] = 0.0
        for b in range(3 * n):
            hessian[a, b] = hessian[b, a] = 0.0
    for i in range(n):
        if i == c:
            continue
        r = 3 * i
        # 2 Hf, rotated back by Rᵗ.
        x, y, turn = 0.0, 0.0, 0.0
        for b in range(3 * n):
            x += information[r, b] * f[b]
            y += information[r + 1, b] * f[b]
            turn += information[r + 2, b] * f[b]
        value += f[r] * x + f[r + 1] * y + f[r + 2] * turn
        x, y, turn = 2 * (cos * x + sin * y), 2 * (cos * y - sin * x), 2 * turn
        dx, dy = d[i, 0], d[i, 1]
        gradient[r], gradient[r + 1], gradient[r + 2] = x, y, turn
        gradient[k] -= x
        gradient[k + 1] -= y
        gradient[k + 2] += dy * x - dx * y - turn
        for j in range(i + 1):
            if j != c:
                _turn_block(information, r, 3 * j, cos, sin, hessian)
        # ∂²f: the first and second derivatives of R by φ̂_c.
        hessian[k + 2, k + 2] -= curvature * (x * dx + y * dy)
        hessian[r, k + 2] = -curvature * y
        hessian[r + 1, k + 2] = curvature * x
        hessian[k, k + 2] += curvature * y
        hessian[k + 1, k + 2] -= curvature * x
    hessian[k + 2, k], hessian[k + 2, k + 1] = hessian[k, k + 2], hessian[k + 1, k + 2]
    _add_columns_of_c(d, c, hessian)
    return value


@kernel
def nscan_value(poses: Array, local: Array, information: Array, fixed: int) -> float:
    """fᵗHf without derivatives."""
    n = poses.shape[0]
    f = np.empty(3 * n)
    _residual(poses, local, fixed, np.empty((n, 2)), f)
    value = 0.0
    for r in range(3 * n):
        pull = 0.0
        for b in range(3 * n):
            pull += information[r, b] * f[b]
        value += f[r] * pull
    return value


@kernel
def _residual(poses: Array, local: Array, c: int, d: Array, f: Array) -> tuple[float, float]:
    """Write d (n, 2) and f (3n,), whose part of pose c is 0; returns R as (cos θ, sin θ)."""
    theta = local[c, 2] - poses[c, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    for i in range(poses.shape[0]):
        d[i, 0], d[i, 1] = poses[i, 0] - poses[c, 0], poses[i, 1] - poses[c, 1]
        f[3 * i] = cos * d[i, 0] - sin * d[i, 1] + local[c, 0] - local[i, 0]
        f[3 * i + 1] = sin * d[i, 0] + cos * d[i, 1] + local[c, 1] - local[i, 1]
        turn = theta + poses[i, 2] - local[i, 2]
        f[3 * i + 2] = turn - 2 * np.pi * np.round(turn / (2 * np.pi))
    return cos, sin


@kernel
def _turn_block(information: Array, r: int, s: int, cos: float, sin: float, hessian: Array) -> None:
    """The block (r, s) of 2 RᵗHR, and its mirror image."""
    for b in range(3):
        x, y = information[r, s + b], information[r + 1, s + b]
        hessian[r, s + b] = 2 * (cos * x + sin * y)
        hessian[r + 1, s + b] = 2 * (cos * y - sin * x)
        hessian[r + 2, s + b] = 2 * information[r + 2, s + b]
    for a in range(3):
        x, y = hessian[r + a, s], hessian[r + a, s + 1]
        hessian[r + a, s], hessian[r + a, s + 1] = cos * x + sin * y, cos * y - sin * x
    for a in range(3):
        for b in range(3):
            hessian[s + b, r + a] = hessian[r + a, s + b]


@kernel
def _add_columns_of_c(d: Array, c: int, hessian: Array) -> None:
    """Blocks (i, c) += Σ_j H_ij A_j and (c, c) += Σ_ij A_iᵗ H_ij A_j, from the blocks H_ij of the others."""
    k = 3 * c
    for i in range(d.shape[0]):
        if i == c:
            continue
        dx, dy = d[i, 0], d[i, 1]
        for a in range(3):
            r = 3 * i + a
            x, y, turn = 0.0, 0.0, 0.0
            for j in range(d.shape[0]):
                if j != c:
                    hx, hy = hessian[r, 3 * j], hessian[r, 3 * j + 1]
                    x -= hx
                    y -= hy
                    turn += d[j, 1] * hx - d[j, 0] * hy - hessian[r, 3 * j + 2]
            for b, value in enumerate((x, y, turn)):
                if a < 2:
                    hessian[k + a, k + b] -= value
                    hessian[k + 2, k + b] += (dy if a == 0 else -dx) * value
                else:
                    hessian[k + 2, k + b] -= value
                hessian[r, k + b] += value
                hessian[k + b, r] = hessian[r, k + b]
