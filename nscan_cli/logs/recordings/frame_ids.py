"""Names of coordinate frames in recordings, by the conventions of ROS (REP 105)."""

from __future__ import annotations

BASE_FRAMES = ("base_footprint", "base_link")
"""Frames of a robot, the preferred one first."""
ODOM_FRAMES = ("odom", "odom_combined")
"""Parent frames of odometry."""
WORLD_FRAMES = (*ODOM_FRAMES, "map", "world", "earth")
"""Frames that are fixed in the world: what moves in one of them is the robot itself."""


def normalised(frame: str) -> str:
    """A frame without the slash in front that tf of ROS 1 could write."""
    return frame.removeprefix("/")


def without_prefix(frame: str) -> str:
    """A frame without the name of its robot (tf_prefix): base_link for robot1/base_link."""
    return frame.rpartition("/")[2]


def tf_prefix(frame: str) -> str:
    """The name of the robot in front of a frame; empty where there is none."""
    return frame.rpartition("/")[0]


def is_world_frame(frame: str) -> bool:
    """Whether a frame is fixed in the world."""
    return without_prefix(frame) in WORLD_FRAMES
