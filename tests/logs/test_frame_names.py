"""What a log calls its frames, for results that have such frames too."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.frame_names import DEFAULT_FRAMES, FrameNames, distinct_frame_names
from tests.logs.recordings.messages import MOUNT, drive, with_scans

AT_ORIGIN, AHEAD = np.zeros(3), np.array([0.2, 0.0, 0.0])


@pytest.mark.parametrize(
    ("laser", "robot", "odometry", "mount", "expected"),
    [
        ("front", "chassis", "wheels", AHEAD, FrameNames("front", "chassis", "wheels")),
        ("", "", "", AHEAD, DEFAULT_FRAMES),
        ("front", "", "", AHEAD, FrameNames("front", "base_link", "odom")),
        ("base_link", "base_link", "odom", AT_ORIGIN, FrameNames("base_link", "base_link", "odom")),
        # The user mounts a laser elsewhere than where its frame is.
        ("base_link", "base_link", "odom", AHEAD, DEFAULT_FRAMES),
        # The result's own frame has to be none of the others.
        ("front", "chassis", "map", AHEAD, DEFAULT_FRAMES),
        ("map", "chassis", "odom", AHEAD, DEFAULT_FRAMES),
        ("odom", "chassis", "odom", AHEAD, DEFAULT_FRAMES),
    ],
)
def test_names_that_clash_are_not_kept(laser, robot, odometry, mount, expected):
    assert distinct_frame_names(laser, robot, odometry, mount) == expected


def test_of_a_recording(read):
    scans = [
        one.with_scan(frame="front") if one.topic == "/scan" else one
        for one in drive(mount=[MOUNT._replace(child="front")])
    ]
    assert read(scans).frames == FrameNames("front", "base_link", "odom")
    assert read(with_scans(frame="base_link")).frames == FrameNames("base_link", "base_link", "odom")
    # Nothing but the transform names the robot.
    bare = [one for one in scans if one.topic != "/odom"]
    assert read(bare).frames.robot == "base_link"
