import io
import json
import math
import struct
from typing import Any

import numpy as np
import pytest
from PIL import Image

from nscan_cli.mapping.image import map_png, map_yaml
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid


def load_as_nav2(png: bytes, yaml: bytes) -> tuple[np.ndarray, dict[str, Any]]:
    """nav_msgs/OccupancyGrid data (H, W), row 0 least y, by the rules of Nav2's map_io.cpp; trinary."""
    fields: dict[str, Any] = {}
    for line in yaml.decode().splitlines():
        key, _colon, value = line.partition(": ")
        try:
            fields[key] = json.loads(value)
        except json.JSONDecodeError:
            fields[key] = value
    assert fields["mode"] == "trinary"
    assert fields["negate"] == 0
    shade = np.asarray(Image.open(io.BytesIO(png))).astype(float)
    occupancy = (255 - shade) / 255
    data = np.full(shade.shape, -1)
    data[occupancy > fields["occupied_thresh"]] = 100
    data[occupancy < fields["free_thresh"]] = 0
    return data[::-1], fields


@pytest.fixture
def grid() -> OccupancyGrid:
    hits = np.array([[0, 3, 0], [0, 0, 9]], dtype=np.int32)
    misses = np.array([[4, 0, 0], [0, 2, 1]], dtype=np.int32)
    return OccupancyGrid(hits, misses, 0.05, (-1.2, 3.45))


def test_nav2_loads_the_states_that_were_meant(grid):
    data, fields = load_as_nav2(map_png(grid), map_yaml("map.png", grid))
    assert data.tolist() == [[FREE, OCCUPIED, UNKNOWN], [UNKNOWN, FREE, OCCUPIED]]
    assert data.tolist() == grid.states().tolist()
    assert fields["image"] == "map.png"
    assert fields["resolution"] == 0.05
    assert fields["origin"] == [-1.2, 3.45, 0.0]


def test_the_png_is_8_bit_gray_without_alpha_and_has_the_greatest_y_on_top(grid):
    png = map_png(grid)
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    width, height, depth, colour_type = struct.unpack(">IIBB", png[16:26])
    assert (width, height, depth, colour_type) == (3, 2, 8, 0)
    assert b"tRNS" not in png
    assert np.asarray(Image.open(io.BytesIO(png))).tolist() == [[205, 254, 0], [254, 0, 205]]


def test_names_and_numbers_that_yaml_could_misread_are_safe(grid):
    tiny = OccupancyGrid(grid.hits, grid.misses, 0.001, (1e-5, -0.0))
    text = map_yaml('a: "b" #ü.png', tiny).decode()
    assert 'image: "a: \\"b\\" #ü.png"\n' in text
    assert "origin: [0.00001, 0.0, 0.0]\n" in text
    assert "resolution: 0.001\n" in text


def test_the_origin_has_no_rounding_noise(grid):
    cells = OccupancyGrid(grid.hits, grid.misses, 0.05, (-24 * 0.05, 3 * 0.05))
    assert math.isclose(cells.origin[1], 0.15)
    assert "origin: [-1.2, 0.15, 0.0]" in map_yaml("m.png", cells).decode()
