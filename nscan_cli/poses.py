"""SE(2): poses (x, y, φ) in m and rad, their composition and relative poses (paper, III-A).

All functions take and return float64 arrays whose last axis is (x, y, φ); leading axes broadcast.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

MIRRORED = np.array([1.0, -1.0, -1.0])
"""Factors that turn a pose (x, y, φ) into its mirror image across the x axis."""


def wrap(angle: ArrayLike) -> Array:
    """The angle (rad) normalised to (−π, π]."""
    a = np.asarray(angle, dtype=np.float64)
    return a - 2 * np.pi * np.ceil((a - np.pi) / (2 * np.pi))


def are_known(poses: ArrayLike) -> Mask:
    """Which of the poses (…, 3) are known, as a mask (…); an unknown pose is nan."""
    known: Mask = ~np.isnan(np.asarray(poses, dtype=np.float64)[..., 0])
    return known


def path_lengths(poses: Array) -> Array:
    """The length of the path (m) from the first of the poses (N, 3) to each of them, as (N,)."""
    return np.append(0.0, np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T)))


def transform(pose: ArrayLike, points: ArrayLike) -> Array:
    """Eq. (1): transform points (…, 2) from the pose's frame to the frame that the pose is given in."""
    p, x = np.asarray(pose, dtype=np.float64), np.asarray(points, dtype=np.float64)
    c, s = np.cos(p[..., 2]), np.sin(p[..., 2])
    moved = np.empty((*np.broadcast_shapes(p.shape[:-1], x.shape[:-1]), 2))
    moved[..., 0] = c * x[..., 0] - s * x[..., 1] + p[..., 0]
    moved[..., 1] = s * x[..., 0] + c * x[..., 1] + p[..., 1]
    return moved


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """a ⊕ b: pose b, given in the frame of a, in the frame that a is given in."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    if a.ndim == b.ndim == 1:
        return _compose(a.tolist(), b.tolist())
    xy = transform(a, b[..., :2])
    return np.concatenate([xy, wrap(a[..., 2] + b[..., 2])[..., None]], axis=-1)


def relative(a: ArrayLike, b: ArrayLike) -> Array:
    """Eq. (2): a ⊖ b, pose a seen from frame b; it maps points of frame a into frame b."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    if a.ndim == b.ndim == 1:
        return _relative(a.tolist(), b.tolist())
    d = a - b
    c, s = np.cos(b[..., 2]), np.sin(b[..., 2])
    seen = np.empty(d.shape)
    seen[..., 0], seen[..., 1] = c * d[..., 0] + s * d[..., 1], c * d[..., 1] - s * d[..., 0]
    seen[..., 2] = wrap(d[..., 2])
    return seen


# Fast paths for a single pair of poses: numpy takes ten times as long for arrays of one number.


def _compose(a: list[float], b: list[float]) -> Array:
    c, s = _direction(a[2])
    return np.array([c * b[0] - s * b[1] + a[0], s * b[0] + c * b[1] + a[1], _wrap(a[2] + b[2])])


def _relative(a: list[float], b: list[float]) -> Array:
    c, s = _direction(b[2])
    dx, dy = a[0] - b[0], a[1] - b[1]
    return np.array([c * dx + s * dy, c * dy - s * dx, _wrap(a[2] - b[2])])


def _direction(angle: float) -> tuple[float, float]:
    return (math.cos(angle), math.sin(angle)) if math.isfinite(angle) else (math.nan, math.nan)


def _wrap(angle: float) -> float:
    if math.isfinite(angle):
        angle -= 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi))
    return angle


def inverse(a: ArrayLike) -> Array:
    """⊖a: the inverse pose, that is the frame that a is given in, seen from frame a."""
    a = np.asarray(a, dtype=np.float64)
    return relative(np.zeros_like(a), a)


def relative_jacobians(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    """Eq. (9): the derivatives (3, 3) of u = a ⊖ b with respect to a and b, for one pair of poses."""
    u = relative(a, b)
    c, s = np.cos(np.asarray(b)[2]), np.sin(np.asarray(b)[2])
    by_a = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    by_b = np.array([[-c, -s, u[1]], [s, -c, -u[0]], [0.0, 0.0, -1.0]])
    return by_a, by_b


def rotated_information(pose: ArrayLike, information: Array) -> Array:
    """Rotate information or covariances (…, 3, 3) from the frame of `pose` to the one that it is given in."""
    angle = np.asarray(pose, dtype=np.float64)[..., 2]
    rotation = np.zeros((*angle.shape, 3, 3))
    rotation[..., 0, 0] = rotation[..., 1, 1] = np.cos(angle)
    rotation[..., 1, 0] = np.sin(angle)
    rotation[..., 0, 1] = -rotation[..., 1, 0]
    rotation[..., 2, 2] = 1.0
    rotated: Array = rotation @ information @ rotation.swapaxes(-1, -2)
    return rotated
