"""The page of a map, and the viewer as a part of another page."""

from __future__ import annotations

import base64
import html
from pathlib import Path

from nscan_cli import __version__
from nscan_cli.files.text import printable
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.occupancy import OccupancyGrid
from nscan_cli.mapping.viewer.map_picture import map_picture
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
