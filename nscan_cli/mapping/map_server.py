"""The picture (PNG or PGM) and the YAML of a map that ROS's map_server and Nav2 load.

Sources: ROS wiki, map_server; Nav2, nav2_map_server/src/map_io.cpp.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.finite import check_finite
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

if TYPE_CHECKING:
    from PIL.Image import Image

Gray = NDArray[np.uint8]

MAP_SERVER_GRAYS = {OCCUPIED: 0, UNKNOWN: 205, FREE: 254}
OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.196
"""Thresholds of the share of black. UNKNOWN has 0.19608, so a free_thresh of 0.25 would load it as free."""
Z_RLE = 3
"""The strategy of zlib: maps are as small as at the best level, in half the time of the default."""


def gray_image(grid: OccupancyGrid, grays: dict[int, int] = MAP_SERVER_GRAYS) -> Gray:
    """(H, W) the gray of the state of every cell; row 0 has the greatest y."""
    table = np.zeros(256, dtype=np.uint8)
    for state, value in grays.items():
        table[state % 256] = value
    cells = grid.states().view(np.uint8)
    # In place, two rows at a time, because a map can be large.
    for low in range((len(cells) + 1) // 2):
        pair = [low, len(cells) - 1 - low]
        cells[pair] = table[cells[pair[::-1]]]
    return cells


class MapImage(NamedTuple):
    """The map that map_server loads. It takes less memory than the counts of the grid."""

    cells: Gray
    """(H, W) MAP_SERVER_GRAYS; row 0 has the greatest y."""
    resolution: float
    """Size of a cell, m."""
    origin: tuple[float, float]
    """x, y (m) of the lower left corner."""


def map_image(grid: OccupancyGrid) -> MapImage:
    """The image of a grid."""
    return MapImage(gray_image(grid), grid.resolution, grid.origin)


def map_png(image: MapImage) -> bytes:
    """The map as map_server's PNG: 8-bit gray without alpha."""
    from PIL import Image

    return png_bytes(Image.fromarray(image.cells))


def map_pgm(image: MapImage) -> bytes:
    """The map as map_server's PGM (Netpbm's P5), 8-bit gray. It is not compressed."""
    height, width = image.cells.shape
    return f"P5\n{width} {height}\n255\n".encode() + image.cells.tobytes()


def map_yaml(image_name: str, image: MapImage, comments: Sequence[str] = ()) -> bytes:
    """The YAML of the map; `image_name` is the path of the image, relative to the folder of the YAML.

    The yaw of the origin is 0, because consumers ignore it.
    """
    check_finite("the origin of the map", image.origin, image.resolution)
    x, y = (_yaml_number(value) for value in image.origin)
    return (
        f"image: {json.dumps(image_name, ensure_ascii=False)}\n"
        "mode: trinary\n"
        f"resolution: {_yaml_number(image.resolution)}\n"
        f"origin: [{x}, {y}, 0.0]\n"
        "negate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESH}\n"
        f"free_thresh: {FREE_THRESH}\n" + "".join(f"# {comment}\n" for comment in comments)
    ).encode()


def png_bytes(image: Image, dpi: int | None = None) -> bytes:
    """A picture as a PNG file, for print at `dpi` dots an inch.

    The bytes depend only on the picture and on the build of Pillow.
    """
    file = io.BytesIO()
    image.save(file, "PNG", compress_type=Z_RLE, dpi=dpi and (dpi, dpi))
    return file.getvalue()


def _yaml_number(value: float) -> str:
    """The number without an exponent, which YAML 1.1 reads as text where no point precedes it."""
    text = f"{value + 0.0:.9f}".rstrip("0")
    return text + "0" if text.endswith(".") else text
