"""The preview of a map for the report: a small PNG, and an SVG of the path and the loops to lay over it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Graph
from nscan_cli.mapping.figures.axes import round_length
from nscan_cli.mapping.figures.map_plots import SOFT_GRAYS
from nscan_cli.mapping.map_server import Gray, gray_image, png_bytes
from nscan_cli.mapping.occupancy import OccupancyGrid
from nscan_cli.poses import Array

PREVIEW_PIXELS = 1400
"""Greatest length of the longer side, pixels: sharp on a screen, and some tens of kilobytes."""
MIN_PATH_STEP = 2.0
"""Least distance between two corners of the drawn path, pixels."""


def map_preview(grid: OccupancyGrid, graph: Graph) -> tuple[bytes, bytes]:
    """The map as a PNG, and the SVG of the graph in units of the PNG's pixels.

    A pixel shows the darkest of its cells, so that walls stay visible.
    """
    cells = gray_image(grid, SOFT_GRAYS)
    side = -(-max(cells.shape) // PREVIEW_PIXELS)
    pixels = _darkest(cells, side)
    height, width = pixels.shape
    per_metre = 1 / (side * grid.resolution)
    places = (graph.poses[:, :2] - np.array(grid.origin)) * per_metre
    places[:, 1] = height - places[:, 1]
    return _png(pixels), _svg(graph, places, width, height, per_metre).encode()


def _darkest(cells: Gray, side: int) -> Gray:
    """(h, w) the darkest of each square of `side` × `side` cells; the lower left corner keeps its place."""
    above, right = -cells.shape[0] % side, -cells.shape[1] % side
    padded = np.pad(cells, ((above, 0), (0, right)), mode="edge")
    height, width = padded.shape[0] // side, padded.shape[1] // side
    darkest: Gray = padded.reshape(height, side, width, side).min(axis=(1, 3))
    return darkest


def _png(pixels: Gray) -> bytes:
    """A PNG with a palette, which has a quarter of the bytes."""
    from PIL import Image

    shades, indices = np.unique(pixels, return_inverse=True)
    image = Image.fromarray(indices.reshape(pixels.shape).astype(np.uint8))
    image.putpalette([shade for shade in shades.tolist() for _ in range(3)])
    return png_bytes(image)


def _svg(graph: Graph, places: Array, width: int, height: int, per_metre: float) -> str:
    """Layers of the classes path, loops and refused, and a scale bar."""
    unit = max(width, height) / 100
    metres = round_length(width / per_metre / 5)
    left, low = 1.5 * unit, height - 1.5 * unit
    end = left + metres * per_metre
    accepted = [loop.nodes for loop in graph.loops if loop.accepted]
    refused = [loop.nodes for loop in graph.loops if not loop.accepted]
    x, y = places[0]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" aria-hidden="true">\n'
        f'<path class="refused" fill="none" d="{_segments_data(places, refused)}"/>\n'
        f'<path class="loops" fill="none" d="{_segments_data(places, accepted)}"/>\n'
        f'<path class="path" fill="none" d="{_path_data(places)}"/>\n'
        f'<circle class="start" cx="{x:.1f}" cy="{y:.1f}" r="{0.6 * unit:.1f}"/>\n'
        '<path class="scale" fill="none" '
        f'd="M{left:.1f} {low - unit:.1f}V{low:.1f}H{end:.1f}v{-unit:.1f}"/>\n'
        f'<text class="scale" x="{left + 0.6 * unit:.1f}" y="{low - 0.8 * unit:.1f}" '
        f'font-size="{2 * unit:.1f}">{metres:g} m</text>\n'
        "</svg>\n"
    )


def _path_data(places: Array) -> str:
    """A line through the places (N, 2); those closer than MIN_PATH_STEP to the one before are left out."""
    kept = [places[0]]
    for place in places[1:]:
        if np.hypot(*(place - kept[-1])) >= MIN_PATH_STEP:
            kept.append(place)
    kept.append(places[-1])
    return "M" + "L".join(_coordinates(place) for place in kept)


def _segments_data(places: Array, pairs: list[tuple[int, int]]) -> str:
    return "".join(f"M{_coordinates(places[a])}L{_coordinates(places[b])}" for a, b in pairs)


def _coordinates(place: NDArray[np.float64]) -> str:
    x, y = place
    return f"{x:.1f} {y:.1f}"
