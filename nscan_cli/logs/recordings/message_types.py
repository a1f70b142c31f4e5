"""The types of messages that are read, by what they give: scans, odometry, transforms, poses."""

from __future__ import annotations

SCAN_TYPES = ("sensor_msgs/msg/LaserScan", "foxglove.LaserScan")
ODOMETRY_TYPES = ("nav_msgs/msg/Odometry", "foxglove.Odometry")
TRANSFORM_TYPES = (
    "tf2_msgs/msg/TFMessage",
    "tf/msg/tfMessage",
    "foxglove.FrameTransform",
    "foxglove.FrameTransforms",
)
PATH_TYPE = "nav_msgs/msg/Path"
"""Each message repeats the poses of those before it, so only the last one of a topic is kept."""
POSE_TYPES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
    "foxglove.PoseInFrame",
    PATH_TYPE,
)
REFERENCE_TYPES = POSE_TYPES + ODOMETRY_TYPES + TRANSFORM_TYPES
"""Types that a reference trajectory can come from."""
READ_TYPES = SCAN_TYPES + REFERENCE_TYPES


def ros2_type_name(name: str) -> str:
    """A message type as ROS 2 writes it; ROS 1 leaves out the /msg/."""
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name
