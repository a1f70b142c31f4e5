"""Decoding: the bytes of a message → a scan or stamped transforms, for every encoding."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Container, Iterator, Sequence
from functools import lru_cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recordings.container import Channel, Message
from nscan_cli.logs.recordings.decoded_messages import (
    Pose3D,
    ScanMessage,
    StampedTransform,
    nanoseconds,
    unknown_encoding,
)
from nscan_cli.logs.recordings.frame_ids import normalised
from nscan_cli.logs.recordings.message_types import TRANSFORM_TYPES
from nscan_cli.logs.skips import Skips

UNREADABLE_DEFINITION = (TypesysError, KeyError, ValueError, IndexError, AttributeError, TypeError, NameError,
                         AssertionError, RecursionError)  # fmt: skip
"""Errors that a damaged definition can raise."""
TF_DEFINITION = "geometry_msgs/TransformStamped[] transforms"
"""The definition of all ROS types in TRANSFORM_TYPES; rosbags has only some of them."""
IDL_ARITHMETIC = re.compile(r"\bconst\b|<<|\*")
"""Expressions in IDL can make numbers of any size; the definitions that are read have none."""
IDL_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
LONGEST_DEFINITION = 1 << 17
"""Characters; the longest definition that is read has about 6,000."""
IDL_PART = "=" * 80 + "\nIDL: "
IDL_INCLUDE = re.compile(r"^[ \t]*#.*$", re.MULTILINE)
UNDECODABLE = (SerdeError, ValueError, IndexError, KeyError, TypeError, AttributeError, AssertionError,
               OverflowError, MemoryError, RecursionError, struct.error)  # fmt: skip
"""Errors that decoding a damaged message can raise; protobuf's own error becomes a ValueError."""


def decoded(
    messages: Sequence[Message], topic: str, types: Container[str], skips: Skips
) -> Iterator[tuple[int, int, Any]]:
    """Number (from 1), log time (ns) and content of the messages of some types on a topic.

    The content is a ScanMessage, or a list of StampedTransforms. Messages of other types, and those that
    cannot be decoded, are skipped. Raises InputDataError when an encoding or a schema is unknown.
    """
    decoders = {one: _decoder(one, skips.file) for one in dict.fromkeys(each.channel for each in messages)}
    for number, message in enumerate(messages, 1):
        try:
            if message.channel.type not in types:
                raise TypeError
            content = decoders[message.channel](message.data)
        except UNDECODABLE:
            skips.add(f"{topic}: cannot be decoded", number)
        else:
            yield number, message.log_time, content


def _decoder(channel: Channel, file: str) -> Callable[[bytes], Any]:
    if channel.type.startswith("foxglove."):
        # It is imported only for recordings that have such messages.
        from nscan_cli.logs.recordings.foxglove import CONVERTERS, foxglove_decoder

        convert, decode = CONVERTERS[channel.type], foxglove_decoder(channel, file)
    else:
        convert, decode = ROS_CONVERTERS[channel.type.rpartition("/")[2]], _ros_decoder(channel, file)
    return lambda data: convert(decode(data))


def _ros_decoder(channel: Channel, file: str) -> Callable[[bytes], Any]:
    if channel.encoding not in ("ros1", "cdr"):
        raise unknown_encoding(channel, file)
    try:
        return _deserializer(channel.type, channel.encoding, channel.schema_encoding, channel.schema)
    except UNREADABLE_DEFINITION as error:
        problem = f"the definition of {channel.type} on {channel.topic} cannot be read"
        remedy = f"record it with its {channel.schema_encoding or 'ROS'} definition"
        raise InputDataError(file, problem, remedy) from error


@lru_cache(maxsize=64)
def _deserializer(name: str, encoding: str, schema_encoding: str, schema: bytes) -> Callable[[bytes], Any]:
    """The deserializer of a message type, by the definition that ROS itself has.

    The definition in the file must agree; bags from before ROS 2 Iron have none. It is only compared,
    because rosbags generates code from a definition, and no file may decide what code is run. Raises one
    of UNREADABLE_DEFINITION.
    """
    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    store.register(
        {
            name: definition
            for transforms in TRANSFORM_TYPES
            if transforms not in store.fielddefs and not transforms.startswith("foxglove.")
            for name, definition in get_types_from_msg(TF_DEFINITION, transforms).items()
        }
    )
    if schema:
        _check_fields(name, _parsed_schema(name, schema_encoding, schema), store.fielddefs)
    deserialize = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    return lambda data: deserialize(data, name)


def _check_fields(name: str, found: Any, known: Any) -> None:
    """Raises ValueError when a message, or one nested in it, has other fields than in ROS."""
    if found[name][1] != known[name][1]:
        raise ValueError(f"{name} has other fields than in ROS")
    for _, (_, detail) in found[name][1]:
        # A field has the name of its type; an array or a sequence has its element type and length.
        inner = detail[0][1] if isinstance(detail[0], tuple) else detail
        # ROS 1 does not define its time type.
        if isinstance(inner, str) and inner in found:
            _check_fields(inner, found, known)


def _parsed_schema(name: str, schema_encoding: str, schema: bytes) -> Any:
    text = schema.decode("utf-8", "replace")
    if len(text) > LONGEST_DEFINITION:
        raise ValueError("it is too long")
    if schema_encoding != "ros2idl":
        return get_types_from_msg(text, name)
    # The included definitions follow as other parts of the text.
    text = IDL_INCLUDE.sub("", text)
    if IDL_ARITHMETIC.search(IDL_COMMENT.sub("", text)):
        raise ValueError("it has numbers that are to be computed")
    if not text.startswith(IDL_PART):
        return get_types_from_idl(text)
    types = {}
    for part in text.split(IDL_PART)[1:]:
        types.update(get_types_from_idl(part.partition("\n")[2]))
    return types


def _ros_scan(message: Any) -> ScanMessage:
    """The stamp is the time of the first beam."""
    header, ranges, step = message.header, message.ranges, message.angle_increment
    if step == 0 and len(ranges) > 1:
        step = (message.angle_max - message.angle_min) / (len(ranges) - 1)
    return ScanMessage(
        nanoseconds(header.stamp.sec, header.stamp.nanosec),
        normalised(header.frame_id),
        message.angle_min,
        step,
        message.range_min,
        message.range_max,
        ranges,
        None,
        message.angle_max,
        message.time_increment,
        message.scan_time,
    )


def _ros_odometry(message: Any) -> list[StampedTransform]:
    pose = message.pose.pose
    return [_stamped_transform(message.header, message.child_frame_id, pose.position, pose.orientation)]


def _ros_transforms(message: Any) -> list[StampedTransform]:
    return [transform for part in message.transforms for transform in _ros_transform(part)]


def _ros_transform(message: Any) -> list[StampedTransform]:
    transform = message.transform
    return [
        _stamped_transform(message.header, message.child_frame_id, transform.translation, transform.rotation)
    ]


def _ros_pose(message: Any) -> list[StampedTransform]:
    # That of PoseWithCovarianceStamped is one deeper.
    pose = getattr(message.pose, "pose", message.pose)
    return [_stamped_transform(message.header, "", pose.position, pose.orientation)]


def _ros_path(message: Any) -> list[StampedTransform]:
    return [transform for pose in message.poses for transform in _ros_pose(pose)]


ROS_CONVERTERS: dict[str, Callable[[Any], Any]] = {
    "LaserScan": _ros_scan,
    "Odometry": _ros_odometry,
    "TransformStamped": _ros_transform,
    "PoseStamped": _ros_pose,
    "PoseWithCovarianceStamped": _ros_pose,
    "Path": _ros_path,
    "TFMessage": _ros_transforms,
    "tfMessage": _ros_transforms,
}
"""Conversions by the name of the type, of which `decoded` gives the results."""


def _stamped_transform(header: Any, child: str, translation: Any, rotation: Any) -> StampedTransform:
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    pose = Pose3D((translation.x, translation.y, translation.z), (x, y, z, w))
    stamp = nanoseconds(header.stamp.sec, header.stamp.nanosec)
    return StampedTransform(stamp, normalised(header.frame_id), normalised(child), pose)
