"""Coordinate frames in space: chains of fixed transforms, and what they say about a laser's mounting."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from nscan_cli.limits import DISTANCE
from nscan_cli.logs.sensed import Placed, Rigid
from nscan_cli.poses import Array

LARGEST_TILT = math.radians(1.0)
STILL = 1e-6
"""m and quaternion units; a transform that moves less is fixed."""


class Frames:
    """Transforms (4, 4) between frames that do not move against each other."""

    def __init__(self) -> None:
        self.fixed: dict[tuple[str, str], Array] = {}

    def add(self, placed: Placed) -> bool:
        """Take up a transform; a later one of the same frames holds. False when it is no rigid motion."""
        matrix = as_matrix(placed.pose)
        if matrix is None:
            return False
        self.fixed[placed.parent, placed.child] = matrix
        return True

    def names(self) -> set[str]:
        """All frames that are known."""
        return {name for pair in self.fixed for name in pair}

    def chain(self, start: str, end: str) -> tuple[list[str], Array] | None:
        """The frames from `start` to `end` by the fewest transforms, and `end` in `start` (4, 4)."""
        ways: dict[str, tuple[list[str], Array]] = {start: ([start], np.eye(4))}
        edges: dict[str, list[tuple[str, Array]]] = {}
        for (parent, child), matrix in self.fixed.items():
            edges.setdefault(parent, []).append((child, matrix))
            edges.setdefault(child, []).append((parent, inverse(matrix)))
        queue = [start]
        for name in queue:
            names, there = ways[name]
            for other, matrix in edges.get(name, []):
                if other not in ways:
                    ways[other] = ([*names, other], there @ matrix)
                    queue.append(other)
        return ways.get(end)


def unmoved(transforms: Iterable[Placed]) -> list[Placed]:
    """The first transform of each pair of frames that never moves against another."""
    first: dict[tuple[str, str], Placed] = {}
    moving = set()
    for placed in transforms:
        pair = (placed.parent, placed.child)
        known = first.setdefault(pair, placed)
        if known is not placed and pair not in moving:
            before, now = known.pose, placed.pose
            parts = (*before.translation, *before.rotation), (*now.translation, *now.rotation)
            if not all(abs(a - b) <= STILL for a, b in zip(*parts, strict=True)):
                moving.add(pair)
    return [placed for pair, placed in first.items() if pair not in moving]


def as_matrix(pose: Rigid) -> Array | None:
    """A pose as a matrix (4, 4); None when it has a value that is none or its quaternion is zero."""
    x, y, z, w = pose.rotation
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not 1e-3 < norm < 1e3 or not all(abs(part) < DISTANCE.value for part in pose.translation):
        return None
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = pose.translation
    return matrix


def inverse(matrix: Array) -> Array:
    """The inverse (4, 4) of a rigid motion."""
    found = np.eye(4)
    found[:3, :3] = matrix[:3, :3].T
    found[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return found


def heading(pose: Rigid) -> float | None:
    """The angle (rad) about the vertical that a pose is turned by; None when it is no pose."""
    x, y, z, w = pose.rotation
    norm = x * x + y * y + z * z + w * w
    if not 1e-6 < norm < 1e6 or not all(abs(part) < DISTANCE.value for part in pose.translation):
        return None
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def planar(matrix: Array) -> tuple[Array, bool, float]:
    """A laser's mounting (3,) seen from above, whether it hangs upside down, and its tilt (rad).

    Upside down, its beams run clockwise from the direction of its x axis; the tilt is that of its axis
    against the vertical, either way up.
    """
    up = float(np.clip(matrix[2, 2], -1.0, 1.0))
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    mount: Array = np.round(np.array([matrix[0, 3], matrix[1, 3], yaw]), 9) + 0.0
    return mount, up < 0, math.acos(abs(up))
