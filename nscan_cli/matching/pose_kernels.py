"""SE(2) inside kernels: `nscan_cli.poses` for one pose at a time, without new arrays."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Array


@leaf_kernel
def relative_pose(a: Array, b: Array, out: Array) -> None:
    """Write a ⊖ b, eq. (2); the angle is not normalised."""
    cos, sin = np.cos(b[2]), np.sin(b[2])
    dx, dy = a[0] - b[0], a[1] - b[1]
    out[0], out[1], out[2] = cos * dx + sin * dy, cos * dy - sin * dx, a[2] - b[2]


@leaf_kernel
def composed_pose(a: Array, b: Array, out: Array) -> None:
    """Write a ⊕ b; the angle is not normalised."""
    cos, sin = np.cos(a[2]), np.sin(a[2])
    x, y = cos * b[0] - sin * b[1] + a[0], sin * b[0] + cos * b[1] + a[1]
    out[0], out[1], out[2] = x, y, a[2] + b[2]


@leaf_kernel
def wrapped(angle: float) -> float:
    """The angle (rad) normalised to (−π, π]."""
    return float(angle - 2 * np.pi * np.ceil((angle - np.pi) / (2 * np.pi)))


@kernel
def largest_motion(before: Array, after: Array, fixed: int) -> tuple[float, float, float]:
    """The largest motions of poses (n, 3) as seen from one of them.

    They are the distance and the shift in x or y, m, and the turn, rad. `fixed` is the index of the one.
    """
    distance, shift, turn, was, now = 0.0, 0.0, 0.0, np.empty(3), np.empty(3)
    for k in range(len(before)):
        relative_pose(before[k], before[fixed], was)
        relative_pose(after[k], after[fixed], now)
        x, y = now[0] - was[0], now[1] - was[1]
        distance, shift = max(distance, np.hypot(x, y)), max(shift, abs(x), abs(y))
        turn = max(turn, abs(wrapped(now[2] - was[2])))
    return distance, shift, turn
