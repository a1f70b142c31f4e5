"""A recording as ROS 2 MCAP and as Player text, version 2."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from nscan_cli.poses import Array
from tests.simulation.laser import Laser
from tests.simulation.recording import START, Recording
from tests.simulation.sweeping import SweptRecording

S = 10**9
Message = tuple[str, str, int, Any]
"""Topic, type, time in ns, and the message."""
FARTHEST = 80.0
"""m; what the simulated laser says to have no return is beyond."""


def ros2_mcap(recording: Recording) -> bytes:
    """/scan, /odom and /tf_static of a ROS 2 robot, in chunks packed by zstd, with all checksums."""
    messages = []
    make = _Makers(get_typestore(Stores.ROS2_HUMBLE))
    for k in range(len(recording.times)):
        time = _nanoseconds(START, float(recording.times[k]))
        messages.append(make.odometry_on(time, recording.odometry[k]))
        messages.append(make.scan_on(time, recording.laser, recording.readings[k], 0.0, 0.2))
    return _mcap(make, recording.laser, messages)


def swept_mcap(
    recording: SweptRecording, time_increment: float | None = None, scan_time: float | None = None
) -> bytes:
    """The same of a laser that turns, with odometry at its own times.

    The times of the messages are the true ones unless they are given, s.
    """
    turning, laser = recording.turning, recording.laser
    if time_increment is None:
        time_increment = turning.turn * laser.angle_increment / (2 * np.pi)
    scan_time = turning.period if scan_time is None else scan_time
    make = _Makers(get_typestore(Stores.ROS2_HUMBLE))
    messages = [
        make.odometry_on(_nanoseconds(float(time)), pose)
        for time, pose in zip(recording.odometry.times, recording.odometry.poses, strict=True)
    ]
    messages += [
        make.scan_on(_nanoseconds(float(time)), laser, readings, time_increment, scan_time)
        for time, readings in zip(recording.times, recording.readings, strict=True)
    ]
    return _mcap(make, laser, sorted(messages, key=lambda message: message[2]))


def _mcap(make: _Makers, laser: Laser, messages: list[Message]) -> bytes:
    """The messages, in the order in which they are recorded, behind the mounting of the laser."""
    types, out = make.store, io.BytesIO()
    writer = Writer(out, chunk_size=1 << 16, enable_data_crcs=True)
    # No version: the bytes are to stay the same.
    writer.start(profile="ros2", library="nscan-cli sample")
    channels: dict[str, int] = {}

    def write(topic: str, name: str, time: int, message: Any) -> None:
        if topic not in channels:
            text = types.generate_msgdef(name, ros_version=2)[0]
            schema = writer.register_schema(name, "ros2msg", text.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        writer.add_message(channels[topic], time, bytes(types.serialize_cdr(message, name)), time)

    first = messages[0][2]
    mount = make.transform("base_link", "laser", first, np.array(laser.mount))
    write("/tf_static", "tf2_msgs/msg/TFMessage", first, make("tf2_msgs/msg/TFMessage", transforms=[mount]))
    for topic, name, time, message in messages:
        write(topic, name, time, message)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def player(recording: Recording) -> bytes:
    """laser:0 with its geometry and position2d:0, as Player's writelog prints them."""
    laser = recording.laser
    last = laser.angle_min + (laser.beams - 1) * laser.angle_increment
    angles = f"{laser.angle_min:+07.4f} {last:+07.4f} {laser.angle_increment:+.8f} {FARTHEST:+07.4f}"
    x, y, yaw = laser.mount
    lines = [
        "## Player version 2.0.4",
        "## File version 0.3.0",
        f"{START:014.3f} 16777343 6665 laser 00 004 001 {x:+7.3f} {y:+7.3f} {yaw:7.3f}   0.150   0.150",
    ]
    for k, time in enumerate(recording.times):
        head = f"{START + time:014.3f} 16777343 6665"
        pose = " ".join(f"{value + 0.0:+07.3f}" for value in recording.odometry[k])
        lines.append(f"{head} position2d 00 001 001 {pose} +00.000 +00.000 +00.000 0")
        ranges = "".join([f"{reading:.3f}  0 " for reading in recording.readings[k].tolist()])
        lines.append(f"{head} laser 00 001 001 {k:04d} {angles} {laser.beams:04d} {ranges}")
    return ("\n".join(lines) + "\n").encode()


def _nanoseconds(time: float, later: float = 0.0) -> int:
    """A time and some seconds later in ns."""
    whole = math.floor(time)
    return whole * S + round((time - whole) * S) + round(later * S)


class _Makers:
    """Messages by the names of their types."""

    def __init__(self, types: Any) -> None:
        self.store, self.types = types, types.types

    def __call__(self, name: str, **fields: Any) -> Any:
        return self.types[name](**fields)

    def header(self, time: int, frame: str) -> Any:
        stamp = self("builtin_interfaces/msg/Time", sec=time // S, nanosec=time % S)
        return self("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def turned(self, yaw: float) -> Any:
        half = float(yaw) / 2
        return self("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=np.sin(half), w=np.cos(half))

    def transform(self, parent: str, child: str, time: int, pose: Array) -> Any:
        shift = self("geometry_msgs/msg/Vector3", x=pose[0], y=pose[1], z=0.0)
        moved = self("geometry_msgs/msg/Transform", translation=shift, rotation=self.turned(pose[2]))
        header = self.header(time, parent)
        name = "geometry_msgs/msg/TransformStamped"
        return self(name, header=header, child_frame_id=child, transform=moved)

    def odometry(self, time: int, pose: Array) -> Any:
        at = self("geometry_msgs/msg/Point", x=pose[0], y=pose[1], z=0.0)
        placed = self("geometry_msgs/msg/Pose", position=at, orientation=self.turned(pose[2]))
        still = self("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        zeros = np.zeros(36)
        return self(
            "nav_msgs/msg/Odometry",
            header=self.header(time, "odom"),
            child_frame_id="base_link",
            pose=self("geometry_msgs/msg/PoseWithCovariance", pose=placed, covariance=zeros),
            twist=self(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=self("geometry_msgs/msg/Twist", linear=still, angular=still),
                covariance=zeros,
            ),
        )

    def odometry_on(self, time: int, pose: Array) -> Message:
        return "/odom", "nav_msgs/msg/Odometry", time, self.odometry(time, pose)

    def scan_on(
        self, time: int, laser: Laser, readings: Array, increment: float, scan_time: float
    ) -> Message:
        """A message on /scan, rounded to centimetres."""
        scan = self.scan(time, laser, readings, increment, scan_time)
        return "/scan", "sensor_msgs/msg/LaserScan", time, scan

    def scan(self, time: int, laser: Laser, readings: Array, increment: float, scan_time: float) -> Any:
        ranges = np.round(readings, 2).astype(np.float32)
        ranges[readings >= laser.no_return] = np.inf
        return self(
            "sensor_msgs/msg/LaserScan",
            header=self.header(time, "laser"),
            angle_min=laser.angle_min,
            angle_max=laser.angle_min + (laser.beams - 1) * laser.angle_increment,
            angle_increment=laser.angle_increment,
            time_increment=increment,
            scan_time=scan_time,
            range_min=0.05,
            range_max=FARTHEST,
            ranges=ranges,
            intensities=np.zeros(0, dtype=np.float32),
        )
