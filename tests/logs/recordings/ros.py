"""ROS recordings by other projects' libraries."""

from __future__ import annotations

import io
import shutil
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.logs.recordings import ros_text
from tests.logs.recordings.containers import repacked
from tests.logs.recordings.messages import Content, Odom, S, Scan, Written, turned


def ros_type(content: Content) -> str:
    if isinstance(content, Scan):
        return "sensor_msgs/msg/LaserScan"
    return "nav_msgs/msg/Odometry" if isinstance(content, Odom) else "tf2_msgs/msg/TFMessage"


def ros_message(content: Content, with_seq: bool = False, lists: bool = False) -> dict[str, Any]:
    """The fields of a ROS message, arrays as such or as lists."""

    def array(values: Any, kind: type) -> Any:
        return np.asarray(values, dtype=kind).tolist() if lists else np.asarray(values, dtype=kind)

    def header(stamp: int, frame: str) -> dict[str, Any]:
        fields: dict[str, Any] = {"seq": 7} if with_seq else {}
        sec, nsec = divmod(stamp, S)
        return fields | {"stamp": {"sec": sec, "nanosec": nsec}, "frame_id": frame}

    def named(names: str, values: Iterable[float]) -> dict[str, float]:
        return dict(zip(names, values, strict=True))

    if isinstance(content, Scan):
        return {
            "header": header(content.stamp, content.frame),
            "angle_min": content.angle_min,
            "angle_max": content.angle_max,
            "angle_increment": content.step,
            "time_increment": 0.0,
            "scan_time": 0.0,
            "range_min": content.range_min,
            "range_max": content.range_max,
            "ranges": array(content.ranges, np.float32),
            "intensities": array([], np.float32),
        }
    if isinstance(content, Odom):
        pose = {
            "position": named("xyz", (content.x, content.y, 0.0)),
            "orientation": named("xyzw", turned(content.yaw)),
        }
        still = {"linear": named("xyz", (0.0,) * 3), "angular": named("xyz", (0.0,) * 3)}
        zeros = array([0.0] * 36, np.float64)
        return {
            "header": header(content.stamp, "odom"),
            "child_frame_id": content.child,
            "pose": {"pose": pose, "covariance": zeros},
            "twist": {"twist": still, "covariance": zeros},
        }
    return {
        "transforms": [
            {
                "header": header(tf.stamp, tf.parent),
                "child_frame_id": tf.child,
                "transform": {
                    "translation": named("xyz", tf.xyz),
                    "rotation": named("xyzw", tf.quaternion),
                },
            }
            for tf in content
        ]
    }


def ros2(written: Iterable[Written]) -> bytes:
    """MCAP by mcap-ros2-support: ros2msg, CDR."""
    from mcap_ros2.writer import Writer

    out = io.BytesIO()
    writer = Writer(out, chunk_size=2000)
    schemas: dict[str, Any] = {}
    for one in written:
        name = ros_type(one.content)
        schemas[name] = schemas.get(name) or writer.register_msgdef(name, ros_text.definition(name))
        writer.write_message(
            one.topic, schemas[name], ros_message(one.content, lists=True), log_time=one.log_time
        )
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def ros1(written: Iterable[Written]) -> bytes:
    """MCAP by mcap-ros1-support: ros1msg, ros1; the messages are packed by hand."""
    from mcap_ros1.writer import Writer

    out = io.BytesIO()
    writer = Writer(out, chunk_size=2000)
    classes: dict[str, type] = {}
    for one in written:
        name = ros_type(one.content)
        if name not in classes:
            text = ros_text.definition(name, ros1=True)
            classes[name] = type("Ros1Message", (Ros1Message,), {"_full_text": text})
        message = classes[name]()
        message._type, message.content = name.replace("/msg/", "/"), one.content
        writer.write_message(one.topic, message, log_time=one.log_time)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


class Ros1Message:
    """As much of a genpy message as the writer asks for."""

    content: Any

    def serialize(self, out: Any) -> None:
        def text(value: str) -> bytes:
            return struct.pack("<I", len(value)) + value.encode()

        def header(stamp: int, frame: str) -> bytes:
            return struct.pack("<III", 7, *divmod(stamp, S)) + text(frame)

        content = self.content
        if isinstance(content, Scan):
            ranges = np.asarray(content.ranges, dtype="<f4")
            numbers = (
                content.angle_min,
                content.angle_max,
                content.step,
                0,
                0,
                content.range_min,
                content.range_max,
            )
            out.write(header(content.stamp, content.frame) + struct.pack("<7f", *numbers))
            out.write(struct.pack("<I", len(ranges)) + ranges.tobytes() + struct.pack("<I", 0))
        elif isinstance(content, Odom):
            pose = struct.pack("<7d", content.x, content.y, 0.0, *turned(content.yaw))
            out.write(header(content.stamp, "odom") + text(content.child) + pose + bytes(8 * (36 + 6 + 36)))
        else:
            out.write(struct.pack("<I", len(content)))
            for tf in content:
                out.write(header(tf.stamp, tf.parent) + text(tf.child))
                out.write(struct.pack("<7d", *tf.xyz, *tf.quaternion))


def ros2_idl(written: Iterable[Written]) -> bytes:
    """The same MCAP with the definition of LaserScan as ros2idl, in the parts that ROS 2 writes."""
    return repacked(
        ros2(written), schemas={"sensor_msgs/msg/LaserScan": ("ros2idl", ros_text.LASER_SCAN_IDL.encode())}
    )


Message = tuple[str, str, int, dict[str, Any]]
"""Topic, type, time (ns), fields."""


def messages_of(written: Iterable[Written], with_seq: bool = False) -> Iterator[Message]:
    for one in written:
        yield one.topic, ros_type(one.content), one.log_time, ros_message(one.content, with_seq)


def bag1(written: Iterable[Written], folder: Path, compression: str | None = None) -> bytes:
    """A ROS 1 bag by rosbags; its chunks may be compressed, by BZ2 or LZ4."""
    return bag1_of(messages_of(written, with_seq=True), folder, compression)


def bag1_of(messages: Iterable[Message], folder: Path, compression: str | None = None) -> bytes:
    """The same, with messages of any type."""
    from rosbags.rosbag1 import Writer

    path = folder / "made.bag"
    path.unlink(missing_ok=True)
    store = ros_text.store(ros1=True)
    writer = Writer(path)
    if compression is not None:
        writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        connections: dict[str, Any] = {}
        for topic, name, time, fields in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=store)
            message = ros_text.as_message(store, name, fields)
            writer.write(connections[topic], time, store.serialize_ros1(message, name))
    return path.read_bytes()


def db3(written: Iterable[Written], folder: Path) -> bytes:
    """The SQLite file of a ROS 2 bag by rosbags."""
    return next(bag2(written, folder / "made_bag", "SQLITE3").glob("*.db3")).read_bytes()


def rosbags_mcap(written: Iterable[Written], folder: Path) -> bytes:
    """The MCAP of a ROS 2 bag by rosbags, which writes no checksums."""
    return next(bag2(written, folder / "made_bag", "MCAP").glob("*.mcap")).read_bytes()


def bag2(written: Iterable[Written], path: Path, plugin: str, compression: str | None = None) -> Path:
    """The folder of a ROS 2 bag by rosbags, as a recorder leaves one; compressed by FILE or MESSAGE."""
    return bag2_of(messages_of(written), path, plugin, compression)


def bag2_of(messages: Iterable[Message], path: Path, plugin: str, compression: str | None = None) -> Path:
    """The same, with messages of any type."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    shutil.rmtree(path, ignore_errors=True)
    store = ros_text.store(ros1=False)
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[plugin])
    if compression is not None:
        writer.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, name, time, fields in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=store)
            message = ros_text.as_message(store, name, fields)
            writer.write(connections[topic], time, store.serialize_cdr(message, name))
    return path


def split_bag2(
    written: Iterable[Written], path: Path, plugin: str, count: int = 3, compression: str | None = None
) -> Path:
    """The same of a recorder that begins a new file now and then: NAME_0, NAME_1, …"""
    every = list(written)
    size = -(-len(every) // count)
    names = []
    path.mkdir()
    for part in range(count):
        made = bag2(every[part * size : (part + 1) * size], path.parent / "part", plugin, compression)
        (file,) = (one for one in made.iterdir() if one.name != "metadata.yaml")
        names.append(f"{path.name}_{part}{''.join(file.suffixes)}")
        file.rename(path / names[-1])
    metadata = (made / "metadata.yaml").read_text()
    listed = metadata.replace(f"- {file.name}\n", "- " + "\n  - ".join(names) + "\n")
    assert listed != metadata
    (path / "metadata.yaml").write_text(listed)
    shutil.rmtree(made)
    return path
