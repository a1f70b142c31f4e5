"""Recordings of Foxglove's own messages, by its libraries."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from mcap.writer import Writer as McapWriter

from tests.logs.recordings.messages import LEVEL, Content, Odom, S, Scan, Written, turned


def protobuf(written: Iterable[Written]) -> bytes:
    """MCAP by mcap-protobuf-support with Foxglove's generated classes."""
    from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
    from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
    from foxglove_schemas_protobuf.Odometry_pb2 import Odometry
    from google.protobuf.json_format import ParseDict
    from mcap_protobuf.writer import Writer

    made = {Scan: LaserScan, Odom: Odometry, tuple: FrameTransforms}
    out = io.BytesIO()
    writer = Writer(out, chunk_size=2000)
    for one in written:
        message = ParseDict(foxglove_fields(one.content, protobuf=True), made[type(one.content)]())
        writer.write_message(one.topic, message, log_time=one.log_time)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def foxglove_json(written: Iterable[Written]) -> bytes:
    """MCAP with Foxglove's messages as JSON."""
    out = io.BytesIO()
    writer = McapWriter(out, chunk_size=2000)
    writer.start()
    channels: dict[str, int] = {}
    for one in written:
        name = {Scan: "LaserScan", Odom: "Odometry", tuple: "FrameTransforms"}[type(one.content)]
        if one.topic not in channels:
            schema = writer.register_schema(f"foxglove.{name}", "jsonschema", b'{"type": "object"}')
            channels[one.topic] = writer.register_channel(one.topic, "json", schema)
        data = json.dumps(foxglove_fields(one.content, protobuf=False)).encode()
        writer.add_message(channels[one.topic], one.log_time, data, one.log_time)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def foxglove_fields(content: Content, protobuf: bool) -> dict[str, Any]:
    def time(stamp: int) -> Any:
        if protobuf:
            at = np.datetime64(stamp, "ns")
            return f"{at}Z"
        return {"sec": stamp // S, "nsec": stamp % S}

    def named(names: str, values: Iterable[float]) -> dict[str, float]:
        return dict(zip(names, values, strict=True))

    def pose(xyz: Iterable[float], quaternion: Iterable[float]) -> dict[str, Any]:
        return {"position": named("xyz", xyz), "orientation": named("xyzw", quaternion)}

    if isinstance(content, Scan):
        ranges = [float(value) for value in content.ranges]
        return {
            "timestamp": time(content.stamp),
            "frame_id": content.frame,
            "pose": pose((0, 0, 0), LEVEL),
            "start_angle": content.angle_min,
            "end_angle": content.angle_min + content.step * (len(ranges) - 1),
            "ranges": ranges if protobuf else [v if math.isfinite(v) else None for v in ranges],
        }
    if isinstance(content, Odom):
        where = pose((content.x, content.y, 0.0), turned(content.yaw))
        return {
            "timestamp": time(content.stamp),
            "frame_id": "odom",
            "body_frame_id": content.child,
            "pose": where,
        }
    return {
        "transforms": [
            {
                "timestamp": time(tf.stamp),
                "parent_frame_id": tf.parent,
                "child_frame_id": tf.child,
                "translation": named("xyz", tf.xyz),
                "rotation": named("xyzw", tf.quaternion),
            }
            for tf in content
        ]
    }
