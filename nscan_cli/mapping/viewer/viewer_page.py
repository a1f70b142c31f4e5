"""The page of a map, and the viewer as a part of another page; the picture of the map in them."""

from __future__ import annotations

import base64
import html
from pathlib import Path

import numpy as np

from nscan_cli import __version__
from nscan_cli.files.text import printable
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.figures.map_plots import SOFT_GRAYS
from nscan_cli.mapping.map_server import Gray, gray_image, png_bytes
from nscan_cli.mapping.occupancy import OccupancyGrid
from nscan_cli.mapping.viewer.viewer_data import viewer_data
from nscan_cli.mapping.viewer.viewer_parts import viewer_parts
from nscan_cli.poses import Indices

PAGE_PIXELS = 4096
"""Longest side of the picture of the map in a page of its own."""
EMBEDDED_PIXELS = 1400
"""Longest side of the picture in a page with many maps: sharp on a screen, and some tens of kilobytes."""


def viewer_page(
    title: str, grid: OccupancyGrid, graph: Graph, log: LaserLog, nodes: Indices, rows: Indices
) -> bytes:
    """The HTML file of a map, complete in itself. `nodes` (M,) have the scans in `rows` (M,) of the log."""
    import jinja2
    from markupsafe import Markup

    picture, bounds = map_picture(grid, PAGE_PIXELS)
    viewer = _element(title, picture, viewer_data(graph, bounds, (log, nodes, rows)), "")
    parts = viewer_parts()
    template = jinja2.Template(
        (Path(__file__).parent / "page.html").read_text("utf-8"), autoescape=True, keep_trailing_newline=True
    )
    page = template.render(
        title=title,
        version=__version__,
        style=Markup(parts.style),
        script=Markup(parts.script),
        viewer=Markup(viewer),
    )
    return printable(page).encode()


def embedded_viewer(title: str, grid: OccupancyGrid, graph: Graph) -> bytes:
    """The element of a viewer without scans, for a page that has the viewer's parts."""
    picture, bounds = map_picture(grid, EMBEDDED_PIXELS)
    element = _element(title, picture, viewer_data(graph, bounds, None), " data-embedded")
    return printable(element).encode()


def _element(title: str, picture: bytes, data: bytes, attributes: str) -> str:
    """The element: the picture, which is all that a browser without scripts shows, and the data."""
    png, block = (base64.b64encode(part).decode() for part in (picture, data))
    return (
        f'<div class="viewer"{attributes}><img alt="Map of {html.escape(title)}" '
        f'src="data:image/png;base64,{png}">\n<script type="application/octet-stream">{block}</script></div>'
    )


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
