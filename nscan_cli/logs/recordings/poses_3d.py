"""Poses in space as matrices, over time, and seen from above."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.limits import DISTANCE
from nscan_cli.logs.recordings.decoded_messages import Pose3D
from nscan_cli.poses import Array

LEAST_LENGTH, GREATEST_LENGTH = 1e-3, 1e3
"""Between these lies the length of a valid quaternion."""


class TimedPoses(NamedTuple):
    """Poses over time."""

    times: NDArray[np.int64]
    """(n,) ns, not decreasing"""
    poses: Array
    """(n, 4, 4)"""

    @classmethod
    def of(cls, poses: Sequence[Pose3D], times: Sequence[int | None]) -> TimedPoses:
        """The valid poses (see as_matrices) that have a time (ns), in order of time."""
        timed = [(time, pose) for time, pose in zip(times, poses, strict=True) if time is not None]
        valid, matrices = as_matrices([pose for _, pose in timed])
        found = np.array([time for time, _ in timed], dtype=np.int64)[valid]
        order = np.argsort(found, kind="stable")
        return cls(found[order], matrices[order])


def as_matrix(pose: Pose3D) -> Array | None:
    """A pose as a matrix (4, 4); None when it is not valid (see as_matrices)."""
    _, found = as_matrices([pose])
    return found[0] if len(found) else None


def as_matrices(poses: Sequence[Pose3D]) -> tuple[NDArray[np.bool_], Array]:
    """Which of n poses are valid (n,), and the m valid ones as matrices (m, 4, 4).

    A pose is valid when all its numbers are finite, none exceeds the limit of distances, and the length of
    its quaternion lies between LEAST_LENGTH and GREATEST_LENGTH.
    """
    translations = np.array([pose.translation for pose in poses], dtype=np.float64).reshape(-1, 3)
    rotations = np.array([pose.rotation for pose in poses], dtype=np.float64).reshape(-1, 4)
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, z, w = rotations.T
        norm = np.sqrt(x * x + y * y + z * z + w * w)
        valid = (norm > LEAST_LENGTH) & (norm < GREATEST_LENGTH)
        valid &= (np.abs(translations) < DISTANCE.value).all(axis=1)
    x, y, z, w = (rotations[valid] / norm[valid, None]).T
    found = np.zeros((len(x), 4, 4))
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    found[:, :3, :3] = np.moveaxis(np.array(rows), -1, 0)
    found[:, :3, 3] = translations[valid]
    found[:, 3, 3] = 1.0
    return valid, found


def inverse_transform(matrix: Array) -> Array:
    """The inverse (…, 4, 4) of rigid transforms."""
    found = np.zeros_like(matrix)
    rotation = np.swapaxes(matrix[..., :3, :3], -1, -2)
    found[..., :3, :3] = rotation
    found[..., :3, 3] = -(rotation @ matrix[..., :3, 3:])[..., 0]
    found[..., 3, 3] = 1.0
    return found


def heading(pose: Pose3D) -> float | None:
    """The rotation (rad) of a pose about the vertical; None when the pose is not valid (see as_matrices)."""
    x, y, z, w = pose.rotation
    square = x * x + y * y + z * z + w * w
    is_turn = LEAST_LENGTH**2 < square < GREATEST_LENGTH**2
    if not is_turn or not all(abs(part) < DISTANCE.value for part in pose.translation):
        return None
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def rounded_mount(x: float, y: float, yaw: float) -> Array:
    """A laser's pose on the robot (3,), without the noise of the last digits."""
    mount: Array = np.round(np.array([x, y, yaw]), 9) + 0.0
    return mount


def planar_mount(matrix: Array) -> tuple[Array, bool, float]:
    """The pose (3,) of a laser on the robot seen from above, whether it is upside down, its tilt (rad).

    The beams of a laser that is upside down run clockwise from its x axis. The tilt is the angle between its
    axis and the vertical, either way up.
    """
    up = float(np.clip(matrix[2, 2], -1.0, 1.0))
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    return rounded_mount(matrix[0, 3], matrix[1, 3], yaw), up < 0, math.acos(abs(up))
