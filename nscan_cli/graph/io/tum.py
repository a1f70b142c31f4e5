"""Trajectories in the TUM format: `t x y z qx qy qz qw`, one pose a line, `#` comments.

https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats. Variants are read as well: with commas, other
columns, and times in ns (pose_columns.py).
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.files.finite import check_finite
from nscan_cli.files.limits import DISTANCE, TIME
from nscan_cli.graph.io.pose_columns import (
    COMMENT_MARKS,
    UNIT_TOLERANCE,
    PoseColumns,
    columns_by_content,
    columns_by_name,
    is_header,
    numbered_lines,
    power_by_size,
    split_fields,
)
from nscan_cli.poses import Array, Indices, wrap

TUM_REMEDY = "TUM lines are 't x y z qx qy qz qw'"


@dataclass(frozen=True)
class Trajectory:
    """Poses in order of time."""

    times: Array
    """(N,) seconds, not decreasing."""
    poses: Array
    """(N, 3) x, y and φ."""
    stamps: tuple[str, ...]
    """N times, as written in the source."""
    rows: Indices | None = None
    """(N,) the row of each pose in the source; None: in the same order."""
    spatial: Array | None = None
    """(N, 4) z (m), and the direction upwards in the frame of the body."""

    def __len__(self) -> int:
        return len(self.stamps)

    @classmethod
    def in_order(
        cls, times: Array, poses: Array, stamps: Sequence[str], spatial: Array | None = None
    ) -> Trajectory:
        """The trajectory of poses in any order; poses of equal time keep their order."""
        order = np.argsort(times, kind="stable")
        texts = tuple(stamps[row] for row in order.tolist())
        return cls(times[order], poses[order], texts, order, None if spatial is None else spatial[order])

    @classmethod
    def in_space(cls, stamps: Sequence[str], poses: Array) -> Trajectory:
        """The trajectory of poses (N, 7), in any order: x, y, z and quaternion x, y, z, w; φ is the yaw."""
        x, y, z, qx, qy, qz, qw = poses.T
        yaw = np.arctan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
        up = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), qw**2 + qz**2 - qx**2 - qy**2
        times = np.array([float(stamp) for stamp in stamps])
        return cls.in_order(times, np.column_stack([x, y, yaw]), stamps, np.column_stack([z, *up]))


def write_tum(stamps: Sequence[str], poses: Array) -> bytes:
    """The TUM text of poses (N, 3) at N stamps; positions and quaternions have 9 decimals.

    Raises NotFiniteError.
    """
    check_finite("the trajectory", poses)
    half = 0.5 * wrap(poses[:, 2])
    columns = np.round(np.column_stack([poses[:, :2], np.sin(half), np.cos(half)]), 9) + 0.0
    return "".join(
        f"{stamp} {x:.9f} {y:.9f} 0 0 0 {qz:.9f} {qw:.9f}\n"
        for stamp, (x, y, qz, qw) in zip(stamps, columns.tolist(), strict=True)
    ).encode()


def parse_tum(data: bytes, name: str) -> Trajectory:
    """The trajectory of TUM text, sorted by time; errors name the file `name`.

    Raises InputDataError on a malformed line or where there is no pose.
    """
    stamps: list[str] = []
    values = array("d")
    columns: PoseColumns | None = None
    power = 0
    for number, line in numbered_lines(data):
        if not stamps and is_header(line):
            named = columns_by_name(line)
            columns = named or columns
            if named or line[0] in COMMENT_MARKS:
                continue
        if line[0] in COMMENT_MARKS:
            continue
        try:
            if not stamps:
                columns = columns or columns_by_content(line)
                power = columns.power or 0
                if columns.power is None:
                    power = power_by_size(split_fields(line)[columns.time])
            assert columns is not None
            stamp, pose = _pose_of_line(split_fields(line), columns, power)
        except (ValueError, IndexError) as error:
            raise InputDataError(name, str(error), TUM_REMEDY, line=number) from error
        values.extend(pose)
        stamps.append(stamp)
    if not stamps:
        raise InputDataError(name, "no pose in it", TUM_REMEDY)
    return Trajectory.in_space(stamps, np.array(values).reshape(-1, 7))


def _pose_of_line(fields: list[str], columns: PoseColumns, power: int) -> tuple[str, list[float]]:
    """The stamp (s), and x, y, z and quaternion of a line. Raises ValueError where it is malformed."""
    if len(fields) != (columns.count or max(len(fields), columns.least)):
        raise ValueError(f"{len(fields)} columns instead of {columns.count or columns.least}")
    x, y, z = columns.position
    time = float(fields[columns.time])
    used = [fields[x], fields[y], "0" if z is None else fields[z], *(fields[at] for at in columns.rotation)]
    values = [float(field) for field in used]
    if not all(math.isfinite(value) for value in (time, *values)):
        raise ValueError("a number is not finite")
    if abs(time) > TIME.value * 10**power or max(map(abs, values)) > DISTANCE.value:
        raise ValueError(f"a number is beyond {DISTANCE.value:g}, or the time beyond {TIME.text()}")
    if abs(math.hypot(*values[3:]) - 1) > UNIT_TOLERANCE:
        raise ValueError("the quaternion is not of length 1")
    return columns.stamp(fields, power), values
