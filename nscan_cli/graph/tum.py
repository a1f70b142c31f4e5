"""Trajectories in the TUM format: `t x y z qx qy qz qw`, one pose a line, `#` comments.

https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.finite import check_finite
from nscan_cli.inputs import label, read_text
from nscan_cli.limits import DISTANCE, GRAPH, TIME
from nscan_cli.poses import Array, wrap

COLUMNS = 8
REMEDY = "TUM lines are 't x y z qx qy qz qw'"
UNIT_TOLERANCE = 0.01
"""How far the length of a quaternion may be from 1: what rounding to a few digits does, and no more."""


@dataclass(frozen=True)
class Trajectory:
    """Poses in order of time."""

    times: Array
    """(N,) seconds, not decreasing."""
    poses: Array
    """(N, 3)"""
    stamps: tuple[str, ...]
    """N times as the source wrote them."""

    def __len__(self) -> int:
        return len(self.stamps)

    @classmethod
    def in_order(cls, times: Array, poses: Array, stamps: Sequence[str]) -> Trajectory:
        """The trajectory of poses in any order; those of equal time keep theirs."""
        order = np.argsort(times, kind="stable")
        return cls(times[order], poses[order], tuple(stamps[row] for row in order.tolist()))


def write_tum(stamps: Sequence[str], poses: Array) -> bytes:
    """Poses (N, 3) at N stamps, which are kept as they are; positions and quaternions with 9 decimals.

    Raises NotFiniteError.
    """
    check_finite("the trajectory", poses)
    half = 0.5 * wrap(poses[:, 2])
    columns = np.round(np.column_stack([poses[:, :2], np.sin(half), np.cos(half)]), 9) + 0.0
    return "".join(
        f"{stamp} {x:.9f} {y:.9f} 0 0 0 {qz:.9f} {qw:.9f}\n"
        for stamp, (x, y, qz, qw) in zip(stamps, columns.tolist(), strict=True)
    ).encode()


def read_tum(path: str) -> Trajectory:
    """The trajectory of a TUM file, sorted by time; "-" reads standard input.

    z is left out, and of the rotation only the yaw is kept. Raises InputMissingError when the file
    cannot be read, InputDataError on a line that is not of the format or when there is no pose.
    """
    return parse_tum(read_text(path, GRAPH), label(path))


def parse_tum(data: bytes, name: str) -> Trajectory:
    """The trajectory of TUM text; `name` is the file that errors name. Raises InputDataError."""
    stamps: list[str] = []
    rows: list[tuple[float, float, float, float]] = []
    for number, line in enumerate(io.BytesIO(data), start=1):
        fields = line.decode("utf-8", errors="replace").split()
        if not fields or fields[0].startswith("#"):
            continue
        try:
            rows.append(_pose(fields))
        except ValueError as error:
            raise InputDataError(name, str(error), REMEDY, line=number) from error
        stamps.append(fields[0])
    if not rows:
        raise InputDataError(name, "no pose in it", REMEDY)
    table = np.array(rows)
    return Trajectory.in_order(table[:, 0], table[:, 1:], stamps)


def _pose(fields: list[str]) -> tuple[float, float, float, float]:
    """Time, x, y and yaw of a line's fields. Raises ValueError saying what is wrong."""
    if len(fields) != COLUMNS:
        raise ValueError(f"{len(fields)} columns instead of {COLUMNS}")
    values = [float(field) for field in fields]
    if not all(math.isfinite(value) for value in values):
        raise ValueError("a number is not finite")
    if abs(values[0]) > TIME.value or max(map(abs, values[1:])) > DISTANCE.value:
        raise ValueError(f"a number is beyond {DISTANCE.value:g}, or the time beyond {TIME.shown()}")
    t, x, y, _, qx, qy, qz, qw = values
    if abs(math.hypot(qx, qy, qz, qw) - 1) > UNIT_TOLERANCE:
        raise ValueError("the quaternion is not of length 1")
    return t, x, y, math.atan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
