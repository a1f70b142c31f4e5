"""Definitions of ROS messages as recordings carry them, from rosbags' own tables."""

from __future__ import annotations

from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

LASER_SCAN_IDL = """\
================================================================================
IDL: sensor_msgs/msg/LaserScan
#include "std_msgs/msg/Header.idl"

module sensor_msgs {
  module msg {
    struct LaserScan {
      std_msgs::msg::Header header;
      @unit (value="radians")
      float angle_min;
      float angle_max;
      float angle_increment;
      float time_increment;
      float scan_time;
      float range_min;
      float range_max;
      sequence<float> ranges;
      sequence<float> intensities;
    };
  };
};
================================================================================
IDL: std_msgs/msg/Header
#include "builtin_interfaces/msg/Time.idl"

module std_msgs {
  module msg {
    struct Header {
      builtin_interfaces::msg::Time stamp;
      string frame_id;
    };
  };
};
================================================================================
IDL: builtin_interfaces/msg/Time
module builtin_interfaces {
  module msg {
    struct Time {
      int32 sec;
      uint32 nanosec;
    };
  };
};
"""


def store(ros1: bool) -> Any:
    """Where rosbags has its types."""
    if not ros1:
        return get_typestore(Stores.ROS2_HUMBLE)
    types = get_typestore(Stores.ROS1_NOETIC)
    types.register(
        get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
    )
    return types


def definition(name: str, ros1: bool = False) -> str:
    """The text of a message and of all that it consists of."""
    text: str = store(ros1).generate_msgdef(name, ros_version=1 if ros1 else 2)[0]
    return text


def as_message(types: Any, name: str, fields: dict[str, Any]) -> Any:
    """An object of rosbags' own class from nested dictionaries."""
    inner = dict(types.fielddefs[name][1])
    values = {}
    for key, value in fields.items():
        detail = inner[key][1]
        if isinstance(value, dict):
            values[key] = as_message(types, detail, value)
        elif isinstance(value, list):
            element = detail[0][1]
            values[key] = [as_message(types, element, part) for part in value]
        else:
            values[key] = value
    return types.types[name](**values)
