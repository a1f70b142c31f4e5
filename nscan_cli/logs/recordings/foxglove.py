"""Decoders of Foxglove's own messages, in protobuf or JSON.

Source: docs.foxglove.dev, schemas LaserScan, FrameTransform, FrameTransforms, Odometry, PoseInFrame. A field
that a message leaves out is zero; a quaternion of zeros means no rotation.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recordings.container import Channel
from nscan_cli.logs.recordings.decoded_messages import (
    Pose3D,
    ScanMessage,
    StampedTransform,
    nanoseconds,
    unknown_encoding,
)
from nscan_cli.logs.recordings.frame_ids import normalised

JSON_OBJECTS = ("timestamp", "pose", "position", "orientation", "translation", "rotation")
"""Fields that are objects, not numbers."""


def foxglove_decoder(channel: Channel, file: str) -> Callable[[bytes], Any]:
    """The decoder of a channel; objects from JSON have the same attributes as those from protobuf.

    Raises InputDataError when the encoding is neither of them, or the schema cannot be read.
    """
    if channel.encoding == "json":
        return lambda data: _JsonObject(json.loads(data))
    if channel.encoding == "protobuf" and channel.schema_encoding == "protobuf":
        return _protobuf_decoder(channel, file)
    raise unknown_encoding(channel, file)


def _scan(message: Any) -> ScanMessage:
    """Beams from start_angle to end_angle, both included, without range limits."""
    # JSON has null for an invalid range; NumPy turns it into nan.
    ranges = np.array(message.ranges, dtype=np.float64)
    if ranges.ndim != 1:
        raise ValueError("its ranges are not a list of numbers")
    first, last = float(message.start_angle), float(message.end_angle)
    step = (last - first) / max(len(ranges) - 1, 1)
    frame = normalised(message.frame_id)
    pose = _pose3d(message.pose.position, message.pose.orientation)
    # The increment of a scan is never 0, not even that of a single beam.
    return ScanMessage(_timestamp(message), frame, first, step or 1.0, 0.0, math.inf, ranges, pose)


def _odometry(message: Any) -> list[StampedTransform]:
    at, rotation = message.pose.position, message.pose.orientation
    return [_stamped_pose(message, message.frame_id, message.body_frame_id, at, rotation)]


def _pose_in_frame(message: Any) -> list[StampedTransform]:
    return [_stamped_pose(message, message.frame_id, "", message.pose.position, message.pose.orientation)]


def _frame_transform(message: Any) -> list[StampedTransform]:
    parent, child = message.parent_frame_id, message.child_frame_id
    return [_stamped_pose(message, parent, child, message.translation, message.rotation)]


def _frame_transforms(message: Any) -> list[StampedTransform]:
    return [transform for part in message.transforms for transform in _frame_transform(part)]


CONVERTERS: Mapping[str, Callable[[Any], Any]] = {
    "foxglove.LaserScan": _scan,
    "foxglove.Odometry": _odometry,
    "foxglove.PoseInFrame": _pose_in_frame,
    "foxglove.FrameTransform": _frame_transform,
    "foxglove.FrameTransforms": _frame_transforms,
}
"""Conversions by type, to what decoding.decoded gives."""


class _JsonObject:
    """A JSON object with its fields as attributes; a missing one is zero, as in protobuf."""

    def __init__(self, fields: Any) -> None:
        self.fields: Mapping[str, Any] = {} if fields is None else dict(fields)

    def __getattr__(self, name: str) -> Any:
        value = self.fields.get(name)
        if isinstance(value, Mapping) or (value is None and name in JSON_OBJECTS):
            return _JsonObject(value)
        if name == "transforms":
            return [_JsonObject(part) for part in value or []]
        if value is None:
            return {"ranges": [], "frame_id": ""}.get(name, "" if name.endswith("_id") else 0.0)
        return value


def _timestamp(message: Any) -> int:
    time = message.timestamp
    if isinstance(time, _JsonObject):
        # Foxglove's JSON schema has sec and nsec; some writers use the names of protobuf.
        return nanoseconds(time.sec or time.seconds, time.nsec or time.nanos)
    return nanoseconds(time.seconds, time.nanos)


def _pose3d(at: Any, turned: Any) -> Pose3D:
    rotation = (float(turned.x), float(turned.y), float(turned.z), float(turned.w))
    translation = (float(at.x), float(at.y), float(at.z))
    return Pose3D(translation, rotation if any(rotation) else (0.0, 0.0, 0.0, 1.0))


def _stamped_pose(message: Any, parent: str, child: str, at: Any, turned: Any) -> StampedTransform:
    pose = _pose3d(at, turned)
    return StampedTransform(_timestamp(message), normalised(parent), normalised(child), pose)


def _protobuf_decoder(channel: Channel, file: str) -> Callable[[bytes], Any]:
    from google.protobuf.descriptor_pb2 import FileDescriptorSet
    from google.protobuf.message import DecodeError
    from google.protobuf.message_factory import GetMessages

    try:
        message_class = GetMessages(FileDescriptorSet.FromString(channel.schema).file)[channel.type]
    except (DecodeError, KeyError, TypeError, ValueError, RecursionError) as error:
        problem = f"the definition of {channel.type} on {channel.topic} cannot be read"
        raise InputDataError(file, problem, "record it with its protobuf definition") from error

    def decode(data: bytes) -> Any:
        try:
            return message_class.FromString(data)
        except DecodeError as error:
            raise ValueError(str(error)) from error

    return decode
