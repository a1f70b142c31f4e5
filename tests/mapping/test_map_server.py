import io
import math
import struct

import numpy as np
import pytest
from PIL import Image

from nscan_cli.mapping.map_server import map_image, map_png, map_yaml
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, grid_of_counts
from tests.mapping.nav2 import load_map


@pytest.fixture
def grid() -> OccupancyGrid:
    hits = np.array([[0, 3, 0], [0, 0, 9]], dtype=np.int32)
    misses = np.array([[4, 0, 0], [0, 2, 1]], dtype=np.int32)
    return grid_of_counts(hits, misses, 0.05, (-1.2, 3.45))


def test_nav2_loads_the_states_that_were_meant(grid, tmp_path):
    name = 'a: "b" #ü.png'
    (tmp_path / name).write_bytes(map_png(map_image(grid)))
    (tmp_path / "map.yaml").write_bytes(map_yaml(name, map_image(grid)))
    loaded = load_map(tmp_path / "map.yaml")
    assert loaded.data.tolist() == [[FREE, OCCUPIED, UNKNOWN], [UNKNOWN, FREE, OCCUPIED]]
    assert loaded.data.tolist() == grid.states().tolist()
    assert loaded.resolution == 0.05
    assert loaded.origin == (-1.2, 3.45, 0.0)
    # The second cell of the lower row: x from −1.15 to −1.10, y from 3.45 to 3.50.
    assert loaded.at(-1.12, 3.46) == OCCUPIED
    assert loaded.at(-1.12, 3.51) == FREE


def test_the_png_is_8_bit_gray_without_alpha_and_has_the_greatest_y_on_top(grid):
    png = map_png(map_image(grid))
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    width, height, depth, colour_type = struct.unpack(">IIBB", png[16:26])
    assert (width, height, depth, colour_type) == (3, 2, 8, 0)
    assert b"tRNS" not in png
    assert np.asarray(Image.open(io.BytesIO(png))).tolist() == [[205, 254, 0], [254, 0, 205]]


def test_names_and_numbers_that_yaml_could_misread_are_safe(grid):
    tiny = grid_of_counts(grid.hits, grid.misses, 0.001, (1e-5, -0.0))
    text = map_yaml('a: "b" #ü.png', map_image(tiny)).decode()
    assert 'image: "a: \\"b\\" #ü.png"\n' in text
    assert "origin: [0.00001, 0.0, 0.0]\n" in text
    assert "resolution: 0.001\n" in text


def test_the_origin_has_no_rounding_noise(grid):
    cells = grid_of_counts(grid.hits, grid.misses, 0.05, (-24 * 0.05, 3 * 0.05))
    assert math.isclose(cells.origin[1], 0.15)
    assert "origin: [-1.2, 0.15, 0.0]" in map_yaml("m.png", map_image(cells)).decode()
