"""What every decoder of a recording's messages yields, sweeps and where things are, and what all do alike."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recordings.container import Channel

Quaternion = tuple[float, float, float, float]
"""x, y, z, w"""
Point = tuple[float, float, float]
S = 10**9
"""ns"""
LATEST = 2**63
"""ns"""


class Rigid(NamedTuple):
    """A pose or a transform in space."""

    translation: Point
    """m"""
    rotation: Quaternion


class Sweep(NamedTuple):
    """One scan."""

    stamp: int
    """ns; 0 also where it was never set, see clock.stamps_set."""
    frame: str
    angle_min: float
    """rad"""
    angle_increment: float
    """rad"""
    range_min: float
    """m; readings outside range_min … range_max say nothing."""
    range_max: float
    ranges: NDArray[Any]
    """(B,) m"""
    pose: Rigid | None
    """Of the laser in `frame`, where the message has one."""
    angle_max: float = math.nan
    """rad, where the message says it beside the increment."""


class FramePose(NamedTuple):
    """The child frame in the parent frame at a time: a transform, or odometry."""

    stamp: int
    """ns, likewise."""
    parent: str
    child: str
    pose: Rigid


def nanoseconds(seconds: int, rest: int) -> int:
    """A time in ns; 0 for one before 1970, which was never set. Raises ValueError for one out of bounds."""
    time = int(seconds) * S + int(rest)
    if time >= LATEST:
        raise ValueError("the time is out of bounds")
    return max(time, 0)


def frame_name(name: str) -> str:
    """A frame's name; ROS 1 wrote some with a slash in front."""
    return name.removeprefix("/")


def unknown_encoding(channel: Channel, file: str) -> InputDataError:
    """The error that a channel's messages are in no form that is known."""
    problem = f"{channel.topic} ({channel.type}) is encoded in {channel.encoding or 'nothing that is named'}"
    return InputDataError(file, problem, "record ROS messages as ros1 or cdr, Foxglove's as protobuf or json")
