"""Coordinate frames in space: chains of fixed transforms, and what they say about a laser's mounting."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.limits import DISTANCE
from nscan_cli.logs.recordings.decoded_messages import FramePose, Rigid
from nscan_cli.poses import Array

LARGEST_TILT = math.radians(1.0)
STILL = 1e-6
"""m and quaternion units; a transform that moves less is fixed."""


Pair = tuple[str, str]
"""Parent and child of a transform."""


class Timed(NamedTuple):
    """Poses over time."""

    times: NDArray[np.int64]
    """(n,) ns, increasing"""
    poses: Array
    """(n, 4, 4)"""


class Frames:
    """Transforms (4, 4) between frames that do not move against each other."""

    def __init__(self) -> None:
        self.fixed: dict[Pair, Array] = {}

    def add(self, placed: FramePose) -> bool:
        """Take up a transform; a later one of the same frames holds. False when it is no rigid motion."""
        matrix = as_matrix(placed.pose)
        if matrix is None:
            return False
        self.fixed[placed.parent, placed.child] = matrix
        return True

    def names(self) -> set[str]:
        """All frames that are known."""
        return {name for pair in self.fixed for name in pair}


def way(pairs: Iterable[Pair], start: str, end: str) -> list[str] | None:
    """The frames from `start` to `end` by the fewest of the transforms between pairs of frames."""
    neighbours: dict[str, list[str]] = {}
    for parent, child in pairs:
        neighbours.setdefault(parent, []).append(child)
        neighbours.setdefault(child, []).append(parent)
    ways = {start: [start]}
    queue = [start]
    for name in queue:
        for other in neighbours.get(name, []):
            if other not in ways:
                ways[other] = [*ways[name], other]
                queue.append(other)
    return ways.get(end)


def unmoved(transforms: Iterable[FramePose]) -> list[FramePose]:
    """The first transform of each pair of frames that never moves against another."""
    first: dict[tuple[str, str], FramePose] = {}
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
    _, found = as_matrices([pose])
    return found[0] if len(found) else None


def as_matrices(poses: Sequence[Rigid]) -> tuple[NDArray[np.bool_], Array]:
    """Which of n poses (n,) are some, as as_matrix has it, and these as matrices (m, 4, 4)."""
    places = np.array([pose.translation for pose in poses], dtype=np.float64).reshape(-1, 3)
    turns = np.array([pose.rotation for pose in poses], dtype=np.float64).reshape(-1, 4)
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, z, w = turns.T
        norm = np.sqrt(x * x + y * y + z * z + w * w)
        good = (norm > 1e-3) & (norm < 1e3) & (np.abs(places) < DISTANCE.value).all(axis=1)
    x, y, z, w = (turns[good] / norm[good, None]).T
    found = np.zeros((len(x), 4, 4))
    found[:, 0, 0], found[:, 0, 1], found[:, 0, 2] = (
        1 - 2 * (y * y + z * z),
        2 * (x * y - z * w),
        2 * (x * z + y * w),
    )
    found[:, 1, 0], found[:, 1, 1], found[:, 1, 2] = (
        2 * (x * y + z * w),
        1 - 2 * (x * x + z * z),
        2 * (y * z - x * w),
    )
    found[:, 2, 0], found[:, 2, 1], found[:, 2, 2] = (
        2 * (x * z - y * w),
        2 * (y * z + x * w),
        1 - 2 * (x * x + y * y),
    )
    found[:, :3, 3] = places[good]
    found[:, 3, 3] = 1.0
    return good, found


def over_time(poses: Sequence[Rigid], times: Sequence[int | None]) -> Timed:
    """The poses that are some and have a time (ns)."""
    there = [(time, pose) for time, pose in zip(times, poses, strict=True) if time is not None]
    good, matrices = as_matrices([pose for _, pose in there])
    found = np.array([time for time, _ in there], dtype=np.int64)[good]
    order = np.argsort(found, kind="stable")
    return Timed(found[order], matrices[order])


def inverse_transform(matrix: Array) -> Array:
    """The inverse (…, 4, 4) of rigid motions."""
    found = np.zeros_like(matrix)
    turn = np.swapaxes(matrix[..., :3, :3], -1, -2)
    found[..., :3, :3] = turn
    found[..., :3, 3] = -(turn @ matrix[..., :3, 3:])[..., 0]
    found[..., 3, 3] = 1.0
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
