"""Export of map, path, graph and scans as an MCAP recording of ROS 2 messages, for Foxglove and RViz.

The topics: /map (nav_msgs/OccupancyGrid), /path (nav_msgs/Path), /graph (visualization_msgs/MarkerArray)
and /tf_static once, at the time of the first scan; /scan (sensor_msgs/LaserScan) and /tf for every scan.
Frames as in REP 105: map, odom where there is odometry, base_link (the robot) and laser; the last three have
the names of the log where it has some. Topics with one message are transient local, so that late subscribers
get it, as map_server, tf2 and RViz expect.

https://mcap.dev/spec, https://mcap.dev/spec/registry (profile ros2, schemas ros2msg, messages cdr)
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

import numpy as np

from nscan_cli import __version__
from nscan_cli.errors import WrongUsageError
from nscan_cli.exports.ros_messages import (
    MessageFactory,
    graph_markers,
    map_message,
    path_message,
    scan_message,
    tf_message,
)
from nscan_cli.files.finite import check_finite
from nscan_cli.graph.model import Graph
from nscan_cli.logs.frame_names import MAP
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.seen_at_once import seen_at_once
from nscan_cli.mapping.occupancy import OccupancyGrid
from nscan_cli.poses import Array, Indices, are_known, compose, inverse

TOPICS = {
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/path": "nav_msgs/msg/Path",
    "/graph": "visualization_msgs/msg/MarkerArray",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/scan": "sensor_msgs/msg/LaserScan",
}
STREAMS = ("/tf", "/scan")
"""Topics with a message for every scan; the others have one that stays valid."""
NANOSECONDS = 10**9
SECONDS_A_YEAR = 365.25 * 86400
LAST_SECOND = 2**31
"""The first second that a stamp of ROS cannot hold: its seconds are a signed integer of 32 bits."""


def ros2_recording(log: LaserLog, rows: Indices, nodes: Indices, graph: Graph, grid: OccupancyGrid) -> bytes:
    """The MCAP of a graph and its map `grid`, with the scans in `rows` (N,) of the log at `nodes` (N,).

    Stamps are those of the log. Where ROS cannot hold one (before 0, from 2³¹ s on), all count from the
    first second of the log. A laser that turns is written as if it saw at once. Equal inputs give equal
    bytes. Raises NotFiniteError, and WrongUsageError when the stamps span 2³¹ s or more.
    """
    check_finite("the poses of the recording", graph.poses, graph.known_odometry)
    messages = MessageFactory()
    file = _File(messages)
    stamps = _nanoseconds(graph.stamps)
    times = [stamps[node] for node in nodes.tolist()]
    first = min(times)
    file.write("/map", map_message(messages, grid, first), first)
    file.write("/path", path_message(messages, graph.poses, stamps), first)
    file.write("/graph", graph_markers(messages, graph, first), first)
    names = log.frames
    if names.laser != names.robot:
        link = (names.robot, names.laser, log.mount)
        file.write("/tf_static", tf_message(messages, first, [link]), first)
    robots = graph.poses[nodes]
    log = seen_at_once(log.moving_along(robots, rows))
    corrections = None if graph.odometry is None else _corrections(robots, graph.odometry[nodes])
    odometry = None if corrections is None else compose(inverse(corrections), robots)
    for k, (row, time) in enumerate(zip(rows.tolist(), times, strict=True)):
        if odometry is None or corrections is None:
            links = [(MAP, names.robot, robots[k])]
        else:
            links = [(MAP, names.odometry, corrections[k]), (names.odometry, names.robot, odometry[k])]
        file.write("/tf", tf_message(messages, time, links), time)
        file.write("/scan", scan_message(messages, log, row, time), time)
    return file.finished()


def _corrections(robots: Array, odometry: Array) -> Array | None:
    """(N, 3) poses of the odometry frame in the map, for poses of the robot by map and by odometry.

    Where odometry is missing (nan), that of the scan before holds on: the robot has one parent frame
    throughout. None if odometry is missing everywhere.
    """
    known = np.flatnonzero(are_known(odometry))
    if not len(known):
        return None
    found = compose(robots[known], inverse(odometry[known]))
    return found[np.maximum(np.searchsorted(known, np.arange(len(robots)), side="right") - 1, 0)]


class _File:
    """Writes the MCAP in chunks that are compressed by zstd."""

    def __init__(self, messages: MessageFactory) -> None:
        from mcap.writer import Writer

        self._messages, self._stream = messages, io.BytesIO()
        self._writer = Writer(self._stream)
        self._writer.start(profile="ros2", library=f"nscan-cli {__version__}")
        schemas = {
            name: self._writer.register_schema(name, "ros2msg", messages.definition(name).encode())
            for name in dict.fromkeys(TOPICS.values())
        }
        self._channels = {
            topic: self._writer.register_channel(topic, "cdr", schemas[name], _offered_qos_profiles(topic))
            for topic, name in TOPICS.items()
        }
        self._written = dict.fromkeys(TOPICS, 0)

    def write(self, topic: str, message: Any, time: int) -> None:
        """Add a message of the topic's type; `time` in ns."""
        data = self._messages.encoded(message, TOPICS[topic])
        self._writer.add_message(self._channels[topic], time, data, time, self._written[topic])
        self._written[topic] += 1

    def finished(self) -> bytes:
        """All bytes of the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        return self._stream.getvalue()


def _offered_qos_profiles(topic: str) -> dict[str, str]:
    """The QoS profile that the player of rosbag2 offers on a topic, as its recorder stores it (YAML).

    Policies are the numbers of rmw: old versions of rosbag2 cannot read the names.
    """
    keep_last, reliable, automatic = 1, 1, 1
    transient_local, volatile = 1, 2
    depth, durability = (10, volatile) if topic in STREAMS else (1, transient_local)
    for_ever = "{sec: 9223372036, nsec: 854775807}"
    profile = (
        f"- history: {keep_last}\n  depth: {depth}\n  reliability: {reliable}\n  durability: {durability}\n"
        f"  deadline: {for_ever}\n  lifespan: {for_ever}\n  liveliness: {automatic}\n"
        f"  liveliness_lease_duration: {for_ever}\n  avoid_ros_namespace_conventions: false\n"
    )
    return {"offered_qos_profiles": profile}


def _nanoseconds(stamps: Sequence[str]) -> list[int]:
    """The stamps (s, as text) in ns, without rounding through floats."""
    times = [int((Decimal(stamp) * NANOSECONDS).to_integral_value()) for stamp in stamps]
    first, last = min(times), max(times)
    if first >= 0 and last < LAST_SECOND * NANOSECONDS:
        return times
    start = first // NANOSECONDS * NANOSECONDS
    if last - start >= LAST_SECOND * NANOSECONDS:
        years = (last - first) / NANOSECONDS / SECONDS_A_YEAR
        problem = f"the stamps span {years:.0f} years, and those of ROS 68 at most"
        raise WrongUsageError(f"{problem}; leave out the recording, or choose other scans")
    return [time - start for time in times]
