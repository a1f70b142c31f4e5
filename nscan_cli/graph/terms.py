"""What each relation adds to the energy of a graph, with exact derivatives (paper, IV, eqs. (15) to (25)).

Both kinds are weighed alike: a pairwise relation gives ΔᵗC⁻¹Δ, eq. (17), an nScan relation fᵗHf, eq. (23),
both without a ½. A term of m poses writes its value, gradient (3m,) and Hessian (3m, 3m).
"""

from __future__ import annotations

import numpy as np

from nscan_cli.compiled import kernel
from nscan_cli.poses import Array


@kernel
def pairwise_term(
    a: Array,
    b: Array,
    measurement: Array,
    information: Array,
    curvature: float,
    gradient: Array,
    hessian: Array,
) -> float:
    """ΔᵗC⁻¹Δ with Δ = (b ⊖ a) − p_ab, eqs. (16) and (17).

    `curvature` 1 gives the exact Hessian, 0 its Gauss–Newton part. Variables: a, then b.
    """
    c, s = np.cos(a[2]), np.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    ux, uy = c * dx + s * dy, c * dy - s * dx
    delta = np.empty(3)
    delta[0], delta[1], delta[2] = ux - measurement[0], uy - measurement[1], b[2] - a[2] - measurement[2]
    delta[2] -= 2 * np.pi * np.round(delta[2] / (2 * np.pi))
    jacobian = np.zeros((3, 6))
    jacobian[0, 0], jacobian[0, 1], jacobian[0, 2] = -c, -s, uy
    jacobian[1, 0], jacobian[1, 1], jacobian[1, 2] = s, -c, -ux
    jacobian[2, 2] = -1.0
    jacobian[0, 3], jacobian[0, 4] = c, s
    jacobian[1, 3], jacobian[1, 4] = -s, c
    jacobian[2, 5] = 1.0
    pull = information @ delta
    gradient[:] = 2 * (jacobian.T @ pull)
    hessian[:, :] = 2 * (jacobian.T @ information @ jacobian)
    # 2 (C⁻¹Δ)ᵗ ∂²Δ: every second derivative that is not zero has φ_a in it.
    twice = 2 * curvature
    hessian[2, 2] -= twice * (pull[0] * ux + pull[1] * uy)
    for row, value in (
        (0, pull[0] * s + pull[1] * c),
        (1, pull[1] * s - pull[0] * c),
        (3, -pull[0] * s - pull[1] * c),
        (4, pull[0] * c - pull[1] * s),
    ):
        hessian[row, 2] += twice * value
        hessian[2, row] += twice * value
    return float(delta @ pull)


@kernel
def nscan_difference(poses: Array, local: Array, fixed: int, out: Array) -> None:
    """f, eqs. (19) to (22): global poses (n, 3), mapped into the local frame, less the local ones.

    The mapping is the one that takes global pose c to local pose c, c = `fixed`; it moves with x̂_c.
    """
    theta = local[fixed, 2] - poses[fixed, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    for i in range(poses.shape[0]):
        dx, dy = poses[i, 0] - poses[fixed, 0], poses[i, 1] - poses[fixed, 1]
        out[3 * i] = cos * dx - sin * dy + local[fixed, 0] - local[i, 0]
        out[3 * i + 1] = sin * dx + cos * dy + local[fixed, 1] - local[i, 1]
        turn = theta + poses[i, 2] - local[i, 2]
        out[3 * i + 2] = turn - 2 * np.pi * np.round(turn / (2 * np.pi))


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
    """fᵗHf, eq. (23), with gradient (24) and Hessian (25). Variables: the n global poses in order.

    `curvature` 1 gives the exact Hessian, 0 leaves out its term in ∂²f.
    """
    n = poses.shape[0]
    f = np.empty(3 * n)
    nscan_difference(poses, local, fixed, f)
    pull = information @ f
    theta = local[fixed, 2] - poses[fixed, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    # ∂f/∂x̂: block (i, i) is the rotation by θ, block (i, c) takes it back and turns with φ̂_c.
    jacobian = np.zeros((3 * n, 3 * n))
    second = 0.0
    for i in range(n):
        if i == fixed:
            continue
        dx, dy = poses[i, 0] - poses[fixed, 0], poses[i, 1] - poses[fixed, 1]
        mx, my = cos * dx - sin * dy, sin * dx + cos * dy
        r, k = 3 * i, 3 * fixed
        jacobian[r, r], jacobian[r, r + 1] = cos, -sin
        jacobian[r + 1, r], jacobian[r + 1, r + 1] = sin, cos
        jacobian[r + 2, r + 2] = 1.0
        jacobian[r, k], jacobian[r, k + 1], jacobian[r, k + 2] = -cos, sin, my
        jacobian[r + 1, k], jacobian[r + 1, k + 1], jacobian[r + 1, k + 2] = -sin, -cos, -mx
        jacobian[r + 2, k + 2] = -1.0
        second -= pull[r] * mx + pull[r + 1] * my
    gradient[:] = 2 * (jacobian.T @ pull)
    hessian[:, :] = 2 * (jacobian.T @ (information @ jacobian))
    turning = 3 * fixed + 2
    twice = 2 * curvature
    hessian[turning, turning] += twice * second
    for i in range(n):
        if i == fixed:
            continue
        by_x = twice * (pull[3 * i] * sin - pull[3 * i + 1] * cos)
        by_y = twice * (pull[3 * i] * cos + pull[3 * i + 1] * sin)
        for row, value in (
            (3 * i, by_x),
            (3 * i + 1, by_y),
            (3 * fixed, -by_x),
            (3 * fixed + 1, -by_y),
        ):
            hessian[row, turning] += value
            hessian[turning, row] += value
    return float(f @ pull)
