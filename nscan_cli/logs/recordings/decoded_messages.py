"""Decoded messages: scans and stamped transforms, whatever encoding they come from."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recordings.container import Channel

S = 10**9
"""ns"""
LATEST = 2**63
"""ns; stamps are kept as 64-bit integers."""


class Pose3D(NamedTuple):
    """A pose or a rigid transform in space."""

    translation: tuple[float, float, float]
    """x, y, z; m"""
    rotation: tuple[float, float, float, float]
    """Quaternion x, y, z, w, not necessarily of length 1."""


class ScanMessage(NamedTuple):
    """One scan."""

    stamp: int
    """ns; 0 can mean that it was never set, see message_stamps.valid_stamps."""
    frame: str
    angle_min: float
    """rad"""
    angle_increment: float
    """rad"""
    range_min: float
    """m; readings outside range_min … range_max are invalid."""
    range_max: float
    """m"""
    ranges: NDArray[Any]
    """(B,) m"""
    pose: Pose3D | None
    """Pose of the laser in `frame`; None where the message has none."""
    angle_max: float = math.nan
    """rad; nan where the message does not have it beside the increment."""
    time_increment: float = 0.0
    """s from beam to beam; 0 where the message does not say."""
    scan_time: float = 0.0
    """s from scan to scan; 0 where the message does not say."""


class StampedTransform(NamedTuple):
    """The pose of a child frame in its parent frame at a time: from tf, odometry or a pose message."""

    stamp: int
    """ns; 0 can mean that it was never set."""
    parent: str
    child: str
    """Empty where the message does not name it."""
    pose: Pose3D


def nanoseconds(seconds: int, rest: int) -> int:
    """A time in ns; a negative one counts as never set and gives 0. Raises ValueError from LATEST on."""
    time = int(seconds) * S + int(rest)
    if time >= LATEST:
        raise ValueError("the time is out of bounds")
    return max(time, 0)


def decimal_seconds(stamp: int | None) -> str:
    """A time in ns as seconds with 9 decimals; empty for None."""
    return "" if stamp is None else f"{stamp // S}.{stamp % S:09d}"


def unknown_encoding(channel: Channel, file: str) -> InputDataError:
    """The error for a channel whose messages have an encoding that cannot be read."""
    problem = f"{channel.topic} ({channel.type}) is encoded in {channel.encoding or 'nothing that is named'}"
    return InputDataError(file, problem, "record ROS messages as ros1 or cdr, Foxglove's as protobuf or json")
