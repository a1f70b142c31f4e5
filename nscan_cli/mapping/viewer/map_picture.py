"""The picture of a map for a page: a PNG with a palette. Each pixel is as dark as its darkest cell."""

from __future__ import annotations

import numpy as np

from nscan_cli.mapping.figures.map_plots import SOFT_GRAYS
from nscan_cli.mapping.map_server import Gray, gray_image, png_bytes
from nscan_cli.mapping.occupancy import OccupancyGrid


def map_picture(grid: OccupancyGrid, most_pixels: int) -> tuple[bytes, tuple[float, float, float, float]]:
    """The PNG, at most `most_pixels` wide and high, and its bounds: least x and y, greatest x and y (m)."""
    cells = gray_image(grid, SOFT_GRAYS)
    side = -(-max(cells.shape) // most_pixels)
    pixels = _darkest(cells, side)
    height, width = pixels.shape
    (x, y), size = grid.origin, side * grid.resolution
    return _png(pixels), (x, y, x + width * size, y + height * size)


def _darkest(cells: Gray, side: int) -> Gray:
    """(h, w) the darkest of each square of `side` × `side` cells; the lower left corner keeps its place."""
    above, right = -cells.shape[0] % side, -cells.shape[1] % side
    padded = np.pad(cells, ((above, 0), (0, right)), mode="edge")
    height, width = padded.shape[0] // side, padded.shape[1] // side
    darkest: Gray = padded.reshape(height, side, width, side).min(axis=(1, 3))
    return darkest


def _png(pixels: Gray) -> bytes:
    """A PNG with a palette, which has a quarter of the bytes of one in gray."""
    from PIL import Image

    shades, indices = np.unique(pixels, return_inverse=True)
    image = Image.fromarray(indices.reshape(pixels.shape).astype(np.uint8))
    image.putpalette([shade for shade in shades.tolist() for _ in range(3)])
    return png_bytes(image)
