"""Foxglove's own messages, in protobuf or JSON, as the reader needs them.

Source of the form: docs.foxglove.dev, schemas LaserScan, FrameTransform, FrameTransforms, Odometry. What a
message leaves out has its type's zero, but a quaternion without w, which means no rotation.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recordings.container import Channel
from nscan_cli.logs.recordings.decoded_messages import (
    FramePose,
    Rigid,
    Sweep,
    frame_name,
    nanoseconds,
    unknown_encoding,
)

ENDLESS = float("inf")


def decoder(channel: Channel, file: str) -> Callable[[bytes], Any]:
    """What makes a message of its bytes: of protobuf an object, of JSON one with the same attributes.

    Raises InputDataError when the encoding is neither of them or the schema cannot be read.
    """
    if channel.encoding == "json":
        return lambda data: _Fields(json.loads(data))
    if channel.encoding == "protobuf" and channel.schema_encoding == "protobuf":
        return _protobuf(channel, file)
    raise unknown_encoding(channel, file)


def sweep(message: Any) -> Sweep:
    """foxglove.LaserScan: the beams go from start_angle to end_angle, both included; no range limits."""
    # JSON has null where a beam met nothing, NumPy makes nan of it.
    ranges = np.array(message.ranges, dtype=np.float64)
    if ranges.ndim != 1:
        raise ValueError("its ranges are no list of numbers")
    first, last = float(message.start_angle), float(message.end_angle)
    step = (last - first) / max(len(ranges) - 1, 1)
    frame = frame_name(message.frame_id)
    pose = _rigid(message.pose.position, message.pose.orientation)
    # A single beam has no step, and needs one to be a scan at all.
    return Sweep(_stamp(message), frame, first, step or 1.0, 0.0, ENDLESS, ranges, pose)


def odometry(message: Any) -> list[FramePose]:
    """foxglove.Odometry"""
    pose = _rigid(message.pose.position, message.pose.orientation)
    return [FramePose(_stamp(message), frame_name(message.frame_id), frame_name(message.body_frame_id), pose)]


def pose_in_frame(message: Any) -> list[FramePose]:
    """foxglove.PoseInFrame"""
    pose = _rigid(message.pose.position, message.pose.orientation)
    return [FramePose(_stamp(message), frame_name(message.frame_id), "", pose)]


def transform(message: Any) -> list[FramePose]:
    """foxglove.FrameTransform"""
    pose = _rigid(message.translation, message.rotation)
    parent, child = frame_name(message.parent_frame_id), frame_name(message.child_frame_id)
    return [FramePose(_stamp(message), parent, child, pose)]


def transforms(message: Any) -> list[FramePose]:
    """foxglove.FrameTransforms"""
    return [placed for part in message.transforms for placed in transform(part)]


VIEWS: Mapping[str, Callable[[Any], list[FramePose]]] = {
    "foxglove.Odometry": odometry,
    "foxglove.PoseInFrame": pose_in_frame,
    "foxglove.FrameTransform": transform,
    "foxglove.FrameTransforms": transforms,
}


class _Fields:
    """A JSON object, its fields as attributes; one that is not there is zero, as in protobuf."""

    def __init__(self, fields: Any) -> None:
        self.fields: Mapping[str, Any] = {} if fields is None else dict(fields)

    def __getattr__(self, name: str) -> Any:
        value = self.fields.get(name)
        if isinstance(value, Mapping) or (value is None and name in OBJECTS):
            return _Fields(value)
        if name == "transforms":
            return [_Fields(part) for part in value or []]
        if value is None:
            return {"ranges": [], "frame_id": ""}.get(name, "" if name.endswith("_id") else 0.0)
        return value


OBJECTS = ("timestamp", "pose", "position", "orientation", "translation", "rotation")


def _stamp(message: Any) -> int:
    time = message.timestamp
    if isinstance(time, _Fields):
        # Foxglove's JSON schema says sec and nsec; some writers use protobuf's names.
        return nanoseconds(time.sec or time.seconds, time.nsec or time.nanos)
    return nanoseconds(time.seconds, time.nanos)


def _rigid(at: Any, turned: Any) -> Rigid:
    rotation = (float(turned.x), float(turned.y), float(turned.z), float(turned.w))
    return Rigid((float(at.x), float(at.y), float(at.z)), rotation if any(rotation) else (0.0, 0.0, 0.0, 1.0))


def _protobuf(channel: Channel, file: str) -> Callable[[bytes], Any]:
    from google.protobuf.descriptor_pb2 import FileDescriptorSet
    from google.protobuf.descriptor_pool import DescriptorPool
    from google.protobuf.message import DecodeError
    from google.protobuf.message_factory import GetMessageClass

    try:
        pool = DescriptorPool()
        waiting = {part.name: part for part in FileDescriptorSet.FromString(channel.schema).file}
        while waiting:
            ready = [name for name, part in waiting.items() if not waiting.keys() & set(part.dependency)]
            if not ready:
                raise TypeError("its files need each other")
            for name in ready:
                pool.Add(waiting.pop(name))
        made = GetMessageClass(pool.FindMessageTypeByName(channel.type))
    except (DecodeError, KeyError, TypeError) as error:
        problem = f"the definition of {channel.type} on {channel.topic} cannot be read"
        raise InputDataError(file, problem, "record it with its protobuf definition") from error

    def decode(data: bytes) -> Any:
        try:
            return made.FromString(data)
        except DecodeError as error:
            raise ValueError(str(error)) from error

    return decode
