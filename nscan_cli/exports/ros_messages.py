"""ROS 2 messages made from a graph, its map and its log.

Conventions: REP 103 (m, rad, x forward), REP 105 (frames), REP 117 (inf: no return, nan: no measurement).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.logs.frame_names import MAP
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.figures.canvas import BLUE
from nscan_cli.mapping.figures.graph_edges import EDGE_COLOURS, edges_by_kind
from nscan_cli.mapping.occupancy import OccupancyGrid
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

LINE_LIST, SPHERE_LIST = 5, 7
"""Types of visualization_msgs/Marker."""
ADD_MARKER = 0
"""Action of visualization_msgs/Marker."""
KEYFRAME_SIZE, LINE_WIDTH = 0.15, 0.03
"""Diameter of the ball of a keyframe, and width of the line of a relation, m."""
MARKER_HEIGHT = 0.05
"""Height of the graph above the map, which would hide it otherwise, m."""


class MessageFactory:
    """The message types of ROS 2 Humble, which later ones understand, and their encoding (CDR)."""

    def __init__(self) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._store: Typestore = get_typestore(Stores.ROS2_HUMBLE)

    def make(self, name: str, **fields: Any) -> Any:
        """A message of type `name`, such as "geometry_msgs/Point"."""
        package, _, kind = name.partition("/")
        return self._store.types[f"{package}/msg/{kind}"](**fields)

    def encoded(self, message: Any, name: str) -> bytes:
        """The bytes of a message of the type with full name `name`."""
        return bytes(self._store.serialize_cdr(message, name))

    def definition(self, name: str) -> str:
        """The definition of a type and of those that it is made of."""
        return self._store.generate_msgdef(name, ros_version=2)[0]

    def header(self, time: int, frame: str) -> Any:
        """A stamp (`time` in ns) and a frame."""
        return self.make("std_msgs/Header", stamp=self.stamp(time), frame_id=frame)

    def stamp(self, time: int) -> Any:
        """A time given in ns."""
        seconds, nanoseconds = divmod(time, 10**9)
        return self.make("builtin_interfaces/Time", sec=seconds, nanosec=nanoseconds)

    def point(self, x: float, y: float, z: float = 0.0) -> Any:
        """A point of the floor, or above it."""
        return self.make("geometry_msgs/Point", x=x, y=y, z=z)

    def rotation(self, angle: float) -> Any:
        """The quaternion of a turn about z, rad."""
        z, w = math.sin(angle / 2), math.cos(angle / 2)
        return self.make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=z, w=w)

    def pose(self, x: float, y: float, angle: float) -> Any:
        """A pose on the floor."""
        return self.make("geometry_msgs/Pose", position=self.point(x, y), orientation=self.rotation(angle))


def map_message(ros: MessageFactory, grid: OccupancyGrid, time: int) -> Any:
    """nav_msgs/OccupancyGrid: rows from the least y on, 0 free, 100 occupied, −1 unknown."""
    states = grid.states()
    height, width = states.shape
    return ros.make(
        "nav_msgs/OccupancyGrid",
        header=ros.header(time, MAP),
        info=ros.make(
            "nav_msgs/MapMetaData",
            map_load_time=ros.stamp(time),
            resolution=grid.resolution,
            width=width,
            height=height,
            origin=ros.pose(*grid.origin, 0.0),
        ),
        data=states.ravel(),
    )


def path_message(ros: MessageFactory, poses: Array, times: Sequence[int]) -> Any:
    """nav_msgs/Path of the robot's poses (N, 3) at N times (ns)."""
    stamped = [
        ros.make("geometry_msgs/PoseStamped", header=ros.header(time, MAP), pose=ros.pose(*pose))
        for time, pose in zip(times, poses.tolist(), strict=True)
    ]
    return ros.make("nav_msgs/Path", header=ros.header(min(times), MAP), poses=stamped)


def tf_message(ros: MessageFactory, time: int, links: Sequence[tuple[str, str, Array]]) -> Any:
    """tf2_msgs/TFMessage of (parent frame, child frame, pose (3,) of the child in the parent)."""
    found = []
    for parent, child, pose in links:
        x, y, angle = pose.tolist()
        move = ros.make("geometry_msgs/Vector3", x=x, y=y, z=0.0)
        transform = ros.make("geometry_msgs/Transform", translation=move, rotation=ros.rotation(angle))
        found.append(
            ros.make(
                "geometry_msgs/TransformStamped",
                header=ros.header(time, parent),
                child_frame_id=child,
                transform=transform,
            )
        )
    return ros.make("tf2_msgs/TFMessage", transforms=found)


def scan_message(ros: MessageFactory, log: LaserLog, row: int, time: int) -> Any:
    """sensor_msgs/LaserScan of one row of the log; its angles and ranges have the 32 bits of ROS."""
    low, high = log.range_limits
    first, step = float(log.angle_min[row]), float(log.angle_increment[row])
    ranges = log.readings(row)
    return ros.make(
        "sensor_msgs/LaserScan",
        header=ros.header(time, log.frames.laser),
        angle_min=first,
        angle_max=first + step * (len(ranges) - 1),
        angle_increment=step,
        time_increment=0.0,
        scan_time=0.0,
        range_min=low,
        range_max=high,
        ranges=ranges,
        intensities=np.zeros(0, dtype=np.float32),
    )


def graph_markers(ros: MessageFactory, graph: Graph, time: int) -> Any:
    """visualization_msgs/MarkerArray: keyframes as balls, relations as lines, a colour for each kind."""
    edges = edges_by_kind(graph)
    parts = [("keyframes", SPHERE_LIST, KEYFRAME_SIZE, BLUE, graph.keyframes)]
    parts += [(kind, LINE_LIST, LINE_WIDTH, EDGE_COLOURS[kind], edges[kind]) for kind in EDGE_COLOURS]
    markers = [
        _marker(ros, time, name, kind, size, colour, graph.poses[nodes.ravel(), :2])
        for name, kind, size, colour, nodes in parts
        if len(nodes)
    ]
    return ros.make("visualization_msgs/MarkerArray", markers=markers)


def _marker(
    ros: MessageFactory, time: int, name: str, kind: int, size: float, colour: tuple[int, int, int], at: Array
) -> Any:
    """visualization_msgs/Marker of a list of points (P, 2), m; unused fields are empty."""
    red, green, blue = (part / 255 for part in colour)
    empty = {"header": ros.header(0, ""), "format": "", "data": np.zeros(0, dtype=np.uint8)}
    return ros.make(
        "visualization_msgs/Marker",
        header=ros.header(time, MAP),
        ns=name,
        id=0,
        type=kind,
        action=ADD_MARKER,
        pose=ros.pose(0.0, 0.0, 0.0),
        scale=ros.make("geometry_msgs/Vector3", x=size, y=size, z=size),
        color=ros.make("std_msgs/ColorRGBA", r=red, g=green, b=blue, a=1.0),
        lifetime=ros.make("builtin_interfaces/Duration", sec=0, nanosec=0),
        frame_locked=False,
        points=[ros.point(x, y, MARKER_HEIGHT) for x, y in at.tolist()],
        colors=[],
        texture_resource="",
        texture=ros.make("sensor_msgs/CompressedImage", **empty),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=ros.make("visualization_msgs/MeshFile", filename="", data=np.zeros(0, dtype=np.uint8)),
        mesh_use_embedded_materials=False,
    )
