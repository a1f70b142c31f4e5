"""Every form of recording by its name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.logs.recordings.foxglove import foxglove_json, protobuf
from tests.logs.recordings.messages import Written
from tests.logs.recordings.ros import bag1, db3, ros1, ros2, ros2_idl, rosbags_mcap

FORMS: dict[str, Callable[[list[Written], Path], bytes]] = {
    "ros1": lambda written, _: ros1(written),
    "ros2": lambda written, _: ros2(written),
    "ros2 idl": lambda written, _: ros2_idl(written),
    "protobuf": lambda written, _: protobuf(written),
    "json": lambda written, _: foxglove_json(written),
    "ROS 1 bag": bag1,
    "ROS 2 db3": db3,
    "rosbags mcap": rosbags_mcap,
}
"""What writes each of them; the folder is for libraries that write files."""
