"""The names of the coordinate frames of a log, for results with such frames."""

from __future__ import annotations

from dataclasses import dataclass, replace

from nscan_cli.poses import Array

MAP = "map"
"""The frame of the results."""


@dataclass(frozen=True)
class FrameNames:
    """The names of the coordinate frames in a log, by default those of ROS (REP 105).

    All differ from each other and from MAP, except for a laser in the robot's own frame.
    """

    laser: str = "laser"
    robot: str = "base_link"
    odometry: str = "odom"


DEFAULT_FRAMES = FrameNames()


def distinct_frame_names(laser: str, robot: str, odometry: str, mount: Array) -> FrameNames:
    """The names of a recording, with defaults for empty ones; only defaults if names would coincide.

    A laser in the robot's own frame is at its origin. With another mounting (3,), which the user may give, it
    gets a frame of its own.
    """
    names = FrameNames(
        laser or DEFAULT_FRAMES.laser, robot or DEFAULT_FRAMES.robot, odometry or DEFAULT_FRAMES.odometry
    )
    if names.laser == names.robot and mount.any():
        names = replace(names, laser=DEFAULT_FRAMES.laser)
    count = 3 if names.laser == names.robot else 4
    different = {names.laser, names.robot, names.odometry, MAP}
    return names if len(different) == count else DEFAULT_FRAMES
