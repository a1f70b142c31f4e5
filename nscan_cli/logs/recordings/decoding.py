"""Messages as bytes → what the reader needs of them, whatever they are encoded in."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any, TypeVar

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recordings.container import TRANSFORMS, Channel
from nscan_cli.logs.recordings.decoded_messages import (
    FramePose,
    Rigid,
    Sweep,
    frame_name,
    nanoseconds,
    unknown_encoding,
)

T = TypeVar("T")
NO_DEFINITION = (TypesysError, KeyError, ValueError, IndexError, AttributeError, TypeError, NameError,
                 AssertionError, RecursionError)  # fmt: skip
"""What a damaged definition can raise."""
TF_DEFINITION = "geometry_msgs/TransformStamped[] transforms"
"""Of all TRANSFORMS of ROS, which not all of rosbags' tables have."""
COMPUTED = re.compile(r"\bconst\b|<<|\*")
"""What numbers of any size can be made with in IDL; no message that is read has it."""
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
LONGEST_DEFINITION = 1 << 17
"""Characters; the longest of those that are read has some 6,000."""
IDL_PART = "=" * 80 + "\nIDL: "
INCLUDE = re.compile(r"^[ \t]*#.*$", re.MULTILINE)
UNDECODABLE = (SerdeError, ValueError, IndexError, KeyError, TypeError, AttributeError, AssertionError,
               OverflowError, MemoryError, RecursionError, struct.error)  # fmt: skip
"""What decoding a damaged message can raise; protobuf's own error is turned into ValueError."""


def sweep_decoder(channel: Channel, file: str) -> Callable[[bytes], Sweep]:
    """What turns a message with a scan into one. Raises InputDataError when the channel is not known."""
    return _viewed(channel, file, _foxglove().sweep if _is_foxglove(channel) else _ros_sweep)


def placed_decoder(channel: Channel, file: str) -> Callable[[bytes], list[FramePose]]:
    """What turns a message with odometry, transforms or poses into them. Raises InputDataError likewise."""
    if _is_foxglove(channel):
        return _viewed(channel, file, _foxglove().VIEWS[channel.type])
    return _viewed(channel, file, ROS_VIEWS.get(channel.type.rpartition("/")[2], _ros_transforms))


def _is_foxglove(channel: Channel) -> bool:
    return channel.type.startswith("foxglove.")


def _foxglove() -> Any:
    """The module that only Foxglove's recordings need."""
    from nscan_cli.logs.recordings import foxglove

    return foxglove


def _viewed(channel: Channel, file: str, view: Callable[[Any], T]) -> Callable[[bytes], T]:
    decode = _foxglove().decoder(channel, file) if _is_foxglove(channel) else _ros_decoder(channel, file)
    return lambda data: view(decode(data))


def _ros_decoder(channel: Channel, file: str) -> Callable[[bytes], Any]:
    if channel.encoding not in ("ros1", "cdr"):
        raise unknown_encoding(channel, file)
    try:
        return _deserializer(channel.type, channel.encoding, channel.schema_encoding, channel.schema)
    except NO_DEFINITION as error:
        problem = f"the definition of {channel.type} on {channel.topic} cannot be read"
        remedy = f"record it with its {channel.schema_encoding or 'ROS'} definition"
        raise InputDataError(file, problem, remedy) from error


@lru_cache(maxsize=64)
def _deserializer(name: str, encoding: str, schema_encoding: str, schema: bytes) -> Callable[[bytes], Any]:
    """What decodes a type of message, by ROS's own definition of it.

    The file's has to agree, where it has one: bags written before ROS 2 Iron have none. It is compared
    only, since rosbags makes code of a definition, and no file may say what is run. Raises one of
    NO_DEFINITION.
    """
    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    store.register(
        {
            name: definition
            for transforms in TRANSFORMS
            if transforms not in store.fielddefs and not transforms.startswith("foxglove.")
            for name, definition in get_types_from_msg(TF_DEFINITION, transforms).items()
        }
    )
    if schema:
        found = _types(name, schema_encoding, schema)
        _compare(name, found, store.fielddefs)
    deserialize = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    return lambda data: deserialize(data, name)


def _compare(name: str, found: Any, known: Any) -> None:
    """Raises ValueError when a message, or one that it consists of, has other fields than are known."""
    if found[name][1] != known[name][1]:
        raise ValueError(f"{name} has other fields than in ROS")
    for _, (_, detail) in found[name][1]:
        # Of a field: a type's name; of an array or a sequence: what it consists of, and its length.
        inner = detail[0][1] if isinstance(detail[0], tuple) else detail
        # A time of ROS 1 needs no definition.
        if isinstance(inner, str) and inner in found:
            _compare(inner, found, known)


def _types(name: str, schema_encoding: str, schema: bytes) -> Any:
    text = schema.decode("utf-8", "replace")
    if len(text) > LONGEST_DEFINITION:
        raise ValueError("it is too long")
    if schema_encoding != "ros2idl":
        return get_types_from_msg(text, name)
    # The definitions that a text includes are in its other parts.
    text = INCLUDE.sub("", text)
    if COMPUTED.search(COMMENT.sub("", text)):
        raise ValueError("it has numbers that are to be computed")
    if not text.startswith(IDL_PART):
        return get_types_from_idl(text)
    types = {}
    for part in text.split(IDL_PART)[1:]:
        types.update(get_types_from_idl(part.partition("\n")[2]))
    return types


def _ros_sweep(message: Any) -> Sweep:
    """sensor_msgs/LaserScan; its stamp is the time of the first ray."""
    header, ranges, step = message.header, message.ranges, message.angle_increment
    if step == 0 and len(ranges) > 1:
        step = (message.angle_max - message.angle_min) / (len(ranges) - 1)
    return Sweep(
        nanoseconds(header.stamp.sec, header.stamp.nanosec),
        frame_name(header.frame_id),
        message.angle_min,
        step,
        message.range_min,
        message.range_max,
        ranges,
        None,
        message.angle_max,
    )


def _ros_odometry(message: Any) -> list[FramePose]:
    """nav_msgs/Odometry"""
    pose = message.pose.pose
    return [_ros_placed(message.header, message.child_frame_id, pose.position, pose.orientation)]


def _ros_transforms(message: Any) -> list[FramePose]:
    """tf2_msgs/TFMessage"""
    parts: Iterable[Any] = message.transforms
    return [placed for part in parts for placed in _ros_transform(part)]


def _ros_transform(message: Any) -> list[FramePose]:
    """geometry_msgs/TransformStamped"""
    at, turned = message.transform.translation, message.transform.rotation
    return [_ros_placed(message.header, message.child_frame_id, at, turned)]


def _ros_pose(message: Any) -> list[FramePose]:
    """geometry_msgs/PoseStamped, and PoseWithCovarianceStamped"""
    pose = getattr(message.pose, "pose", message.pose)
    return [_ros_placed(message.header, "", pose.position, pose.orientation)]


def _ros_path(message: Any) -> list[FramePose]:
    """nav_msgs/Path"""
    return [placed for pose in message.poses for placed in _ros_pose(pose)]


ROS_VIEWS: Mapping[str, Callable[[Any], list[FramePose]]] = {
    "Odometry": _ros_odometry,
    "TransformStamped": _ros_transform,
    "PoseStamped": _ros_pose,
    "PoseWithCovarianceStamped": _ros_pose,
    "Path": _ros_path,
}
"""Of the types that place one thing; the others are transforms."""


def _ros_placed(header: Any, child: str, at: Any, turned: Any) -> FramePose:
    pose = Rigid((at.x, at.y, at.z), (turned.x, turned.y, turned.z, turned.w))
    stamp = nanoseconds(header.stamp.sec, header.stamp.nanosec)
    return FramePose(stamp, frame_name(header.frame_id), frame_name(child), pose)
