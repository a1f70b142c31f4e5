"""A loader of maps by the rules of Nav2's map server (nav2_map_server/src/map_io.cpp), on its own.

Rows of the image run downwards from the greatest y; the message's from the least y upwards. A pixel's
shade is the mean of its channels over 255; what is dark is occupied, unless the map is negated.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image


@dataclass(frozen=True)
class LoadedMap:
    """nav_msgs/OccupancyGrid."""

    data: NDArray[np.int64]
    """(H, W) 0 free, 100 occupied, −1 unknown; row 0 is that of least y."""
    resolution: float
    origin: tuple[float, float, float]

    def at(self, x: float, y: float) -> int:
        """The state of the cell that a point (m) of the map's frame lies in."""
        column = int(np.floor((x - self.origin[0]) / self.resolution))
        row = int(np.floor((y - self.origin[1]) / self.resolution))
        return int(self.data[row, column])


def load_map(yaml_file: Path) -> LoadedMap:
    """The map of a YAML file, whose image's name is relative to the YAML's folder; trinary ones only."""
    ruamel = pytest.importorskip("ruamel.yaml", reason="ruamel.yaml is not installed: it comes with rosbags")
    fields: dict[str, Any] = ruamel.YAML(typ="safe", pure=True).load(yaml_file)
    assert fields.get("mode", "trinary") == "trinary"
    with Image.open(yaml_file.parent / fields["image"]) as image:
        pixels = np.asarray(image).astype(float)
    shade = (pixels if pixels.ndim == 2 else pixels.mean(axis=-1)) / 255
    occupancy = shade if int(fields["negate"]) else 1 - shade
    data = np.full(shade.shape, -1)
    data[occupancy > float(fields["occupied_thresh"])] = 100
    data[occupancy < float(fields["free_thresh"])] = 0
    x, y, yaw = (float(value) for value in fields["origin"])
    return LoadedMap(data[::-1], float(fields["resolution"]), (x, y, yaw))
