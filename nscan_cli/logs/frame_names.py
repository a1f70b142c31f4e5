"""The names of a log's coordinate frames, for results that have such frames too."""

from __future__ import annotations

from dataclasses import dataclass, replace

from nscan_cli.poses import Array

MAP = "map"
"""The frame of results."""


@dataclass(frozen=True)
class FrameNames:
    """What a log calls its coordinate frames; where it has no names, those of ROS (REP 105).

    They are different from each other and from MAP, but for a laser in the robot's own frame.
    """

    laser: str = "laser"
    robot: str = "base_link"
    odometry: str = "odom"


DEFAULT_FRAMES = FrameNames()


def distinct_frame_names(laser: str, robot: str, odometry: str, mount: Array) -> FrameNames:
    """The names that a recording has, empty where there is none; the usual ones where they would clash.

    A laser in the robot's own frame is at its origin. With another mounting (3,), as the user may give it,
    it gets a frame of its own.
    """
    names = FrameNames(
        laser or DEFAULT_FRAMES.laser, robot or DEFAULT_FRAMES.robot, odometry or DEFAULT_FRAMES.odometry
    )
    if names.laser == names.robot and mount.any():
        names = replace(names, laser=DEFAULT_FRAMES.laser)
    count = 3 if names.laser == names.robot else 4
    different = {names.laser, names.robot, names.odometry, MAP}
    return names if len(different) == count else DEFAULT_FRAMES
