"""What containers of messages (MCAP, ROS bags) have in common: channels, and their messages as bytes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from nscan_cli.files.limits import INPUT, MB, UNPACKED
from nscan_cli.logs.compression import UNPACKS, ZSTD, unpacked

SCANS = ("sensor_msgs/msg/LaserScan", "foxglove.LaserScan")
ODOMETRY = ("nav_msgs/msg/Odometry", "foxglove.Odometry")
TRANSFORMS = (
    "tf2_msgs/msg/TFMessage",
    "tf/msg/tfMessage",
    "foxglove.FrameTransform",
    "foxglove.FrameTransforms",
)
PATH = "nav_msgs/msg/Path"
"""A message of it has the poses of those before, too: of a topic, the last one is kept."""
POSES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
    "foxglove.PoseInFrame",
    PATH,
)
WANTED = SCANS + ODOMETRY + TRANSFORMS + POSES
"""Types of messages that scans, odometry, mounting and reference poses can come from."""
DAMAGED = "fetch the file again, or use what can be read with --salvage"
"""What to do about damage that may be passed over."""


@dataclass(frozen=True, eq=False)
class Channel:
    """One kind of message on one topic; the same only if it is the same object."""

    topic: str
    type: str
    """As ROS 2 writes it, such as sensor_msgs/msg/LaserScan."""
    encoding: str
    """Of the messages: ros1, cdr, protobuf or json."""
    schema_encoding: str
    """ros1msg, ros2msg, ros2idl, protobuf, jsonschema; empty without a schema."""
    schema: bytes


class Message(NamedTuple):
    """One message, not decoded."""

    channel: Channel
    log_time: int
    """ns"""
    data: bytes


@dataclass
class Recording:
    """The messages of the types in WANTED, by topic and in file order, and how many there are of all."""

    form: str
    messages: dict[str, list[Message]] = field(default_factory=dict)
    counts: dict[Channel, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    checksums: str = "none in this format"
    """Whether damage would have been found."""
    size: int = 0
    """Bytes of the messages."""
    passed: int = 0
    """Bytes that were unpacked on the way, of which only the messages are kept."""

    def pass_on(self, size: int) -> None:
        """Take account of bytes that are unpacked and not kept. Raises ExceededError beyond the limit."""
        self.passed += size
        UNPACKED.check(self.passed / MB, UNPACKS)

    def grow(self, size: int) -> None:
        """Take account of bytes that are kept. Raises ExceededError when they are too many."""
        self.size += size
        INPUT.check(self.size / MB, UNPACKS)

    def keep(self, channel: Channel, log_time: int, data: bytes) -> None:
        """Take up a message. Raises ExceededError when they get too large together.

        rosbag2 may have compressed it on its own: CDR never begins as zstd does. What cannot be unpacked is
        left as it is, for the decoder to refuse.
        """
        if channel.encoding == "cdr" and data.startswith(ZSTD.magic):
            content, problem = unpacked(data, ZSTD)
            data = data if problem else content
        kept = self.messages.setdefault(channel.topic, [])
        if channel.type == PATH:
            self.size -= sum(len(before.data) for before in kept)
            kept.clear()
        self.grow(len(data))
        kept.append(Message(channel, log_time, data))

    def topics(self, types: tuple[str, ...]) -> dict[str, int]:
        """Topics that have messages of some types, and how many."""
        found: dict[str, int] = {}
        for channel, count in self.counts.items():
            if channel.type in types and count:
                found[channel.topic] = found.get(channel.topic, 0) + count
        return dict(sorted(found.items()))

    def listed(self) -> dict[str, int]:
        """All topics with their types, and how many messages each has."""
        found: dict[str, int] = {}
        for channel, count in self.counts.items():
            name = f"{channel.topic} ({channel.type or 'no schema'})"
            found[name] = found.get(name, 0) + count
        return dict(sorted(found.items()))


def ros_name(name: str) -> str:
    """A message type as ROS 2 writes it; ROS 1 leaves out the /msg/."""
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name
