"""What the containers (MCAP, ROS bags) have in common: channels, and messages that are not decoded yet."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

from nscan_cli.files.limits import INPUT, MB, UNPACKED
from nscan_cli.logs.compression import KEEPS_GROWING, ZSTD, decompressed
from nscan_cli.logs.recordings.message_types import PATH_TYPE

DAMAGE_REMEDY = "fetch the file again, or use what can be read with --salvage"


@dataclass(frozen=True, eq=False)
class Channel:
    """One type of message on one topic. Two channels are equal only if they are the same object."""

    topic: str
    type: str
    """The type as ROS 2 writes it, such as sensor_msgs/msg/LaserScan."""
    encoding: str
    """The encoding of the messages: ros1, cdr, protobuf or json."""
    schema_encoding: str
    """ros1msg, ros2msg, ros2idl, protobuf or jsonschema; empty without a schema."""
    schema: bytes


class Message(NamedTuple):
    """One message, not decoded."""

    channel: Channel
    log_time: int
    """ns"""
    data: bytes


@dataclass
class Recording:
    """The messages of the types in READ_TYPES, and the number of messages on each channel."""

    form: str
    messages: dict[str, list[Message]] = field(default_factory=dict)
    """The messages by topic, in the order of the file."""
    counts: dict[Channel, int] = field(default_factory=dict)
    """Also of the channels whose messages are not kept."""
    warnings: list[str] = field(default_factory=list)
    checksums: str = "none in this format"
    """Whether the checksums fit, in words."""
    kept_bytes: int = 0
    """Size of the messages."""
    unpacked_bytes: int = 0
    """Size of all chunks that were unpacked, kept or not."""

    def add_unpacked(self, size: int) -> None:
        """Count unpacked bytes. Raises LimitExceededError beyond the limit."""
        self.unpacked_bytes += size
        UNPACKED.check(self.unpacked_bytes / MB, KEEPS_GROWING)

    def add_kept(self, size: int) -> None:
        """Count bytes that stay in memory. Raises LimitExceededError beyond the limit."""
        self.kept_bytes += size
        INPUT.check(self.kept_bytes / MB, KEEPS_GROWING)

    def add(self, channel: Channel, log_time: int, data: bytes) -> None:
        """Keep a message. Raises LimitExceededError when the messages exceed the limit.

        rosbag2 can compress single messages with zstd; no CDR begins with the bytes of zstd. A message that
        cannot be unpacked stays as it is, and its decoder refuses it.
        """
        if channel.encoding == "cdr" and data.startswith(ZSTD.magic):
            content, problem = decompressed(data, ZSTD)
            data = data if problem else content
        kept = self.messages.setdefault(channel.topic, [])
        if channel.type == PATH_TYPE:
            self.kept_bytes -= sum(len(before.data) for before in kept)
            kept.clear()
        self.add_kept(len(data))
        kept.append(Message(channel, log_time, data))

    def topics_of(self, types: tuple[str, ...]) -> dict[str, int]:
        """The topics that have messages of some types, sorted, and how many each has."""
        found: Counter[str] = Counter()
        for channel, count in self.counts.items():
            if channel.type in types and count:
                found[channel.topic] += count
        return dict(sorted(found.items()))

    def topic_counts(self) -> dict[str, int]:
        """All topics with their types, sorted, and how many messages each has."""
        found: Counter[str] = Counter()
        for channel, count in self.counts.items():
            found[f"{channel.topic} ({channel.type or 'no schema'})"] += count
        return dict(sorted(found.items()))
