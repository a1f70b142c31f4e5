"""Pictures of a map for people: overlays from the graph, a figure for a paper, and two maps compared."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.cleaning import Removed
from nscan_cli.mapping.figures.axes import (
    AXES_MARGINS,
    SCALE_BAR_MARGINS,
    TITLE_MARGINS,
    LegendEntry,
    draw_axes,
    draw_legend_below,
    draw_scale_bar,
)
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, PURPLE, SKY, VERMILLION, Bounds, Canvas, Colour
from nscan_cli.mapping.figures.covariance_ellipses import draw_ellipses
from nscan_cli.mapping.figures.graph_edges import EDGE_COLOURS, edges_by_kind
from nscan_cli.mapping.figures.panels import bounds_around
from nscan_cli.mapping.map_server import gray_image
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, grid_of_counts
from nscan_cli.poses import Array, Indices, Mask, transform

MIN_PIXELS, MAX_PIXELS = 1600, 3200
"""Limits of the longer side of a picture with overlays. The cells of a small map become squares of pixels.
Several cells of a large map become one pixel, which is dark if one of them is, so that walls stay visible."""
PAPER_PIXELS = 2400
"""Longer side of the plot of a figure: 20 cm at 300 dots an inch."""
SOFT_GRAYS = {OCCUPIED: 60, UNKNOWN: 226, FREE: 255}
"""Lighter than MAP_SERVER_GRAYS, so that colours stand out."""
OUTLIER_QUANTILE = 5e-4
"""Share of the points that may lie outside a figure on each of its sides."""
MIN_ELLIPSE = 8.0
"""Least longer half axis of a visible ellipse, units."""
KINDS = (("unconnected", SKY, "not connected"), ("specks", VERMILLION, "specks"), ("gone", PURPLE, "gone"))
"""What cleaning removes: its name in Removed, its colour, and its name in the picture."""


@dataclass(frozen=True)
class Overlays:
    """The things to draw over a map."""

    trajectory: bool = False
    graph: bool = False
    uncertainty: bool = False

    def __bool__(self) -> bool:
        return self.trajectory or self.graph or self.uncertainty


def plot_over_map(grid: OccupancyGrid, graph: Graph, overlays: Overlays) -> Canvas:
    """The map in soft grays with coloured overlays; a scale bar and a legend below."""
    canvas = map_canvas(grid)
    draw_scale_bar(canvas, _draw_overlays(canvas, graph, overlays))
    return canvas


def plot_paper_figure(
    log: LaserLog, rows: Indices, poses: Array, grid: OccupancyGrid, graph: Graph, overlays: Overlays
) -> Canvas:
    """Points and path on white with axes in metres, as in Figs. 6 and 7 of the paper.

    The scans in `rows` (N,) have the `poses` (N, 3). Only points in occupied cells are drawn, so people who
    walked by are left out. A few points far outside, seen through a window, do not enlarge the picture.
    Without overlays, the path is drawn.
    """
    points = _points_of_occupied_cells(log, rows, poses, grid)
    margins = TITLE_MARGINS if overlays.graph or overlays.uncertainty else AXES_MARGINS
    canvas = Canvas.blank(_figure_bounds(points, graph.poses), PAPER_PIXELS, margins)
    canvas.cloud(points, BLACK, 0.6)
    entries = _draw_overlays(canvas, graph, overlays if overlays else Overlays(trajectory=True))
    if margins is TITLE_MARGINS:
        draw_legend_below(canvas, entries)
    else:
        canvas.clear_margins()
        draw_axes(canvas)
    return canvas


def _figure_bounds(points: Array, poses: Array) -> Bounds:
    """Bounds around the poses (N, 3) and the points (M, 2) without OUTLIER_QUANTILE on each side."""
    seen = poses[:, :2]
    if len(points):
        seen = np.concatenate([np.quantile(points, [OUTLIER_QUANTILE, 1 - OUTLIER_QUANTILE], axis=0), seen])
    return bounds_around(seen, spare=0.03)


def _draw_overlays(canvas: Canvas, graph: Graph, overlays: Overlays) -> list[LegendEntry]:
    entries: list[LegendEntry] = []
    if overlays.trajectory:
        # A broad light band is visible beneath the relations.
        colour, width = (SKY, 5.0) if overlays.graph else (BLUE, 2.2)
        canvas.line(graph.poses[:, :2], colour, width)
        entries.append(("line", colour, "path"))
    if overlays.graph:
        entries += _draw_graph(canvas, graph)
    if overlays.uncertainty:
        entries += _draw_uncertainty(canvas, graph)
    return entries


def map_canvas(grid: OccupancyGrid) -> Canvas:
    """The map in soft grays, with a margin for a scale bar."""
    background, cells_per_pixel = _background_image(grid)
    return Canvas(grid.bounds, 1 / (cells_per_pixel * grid.resolution), background, SCALE_BAR_MARGINS)


def _background_image(grid: OccupancyGrid) -> tuple[NDArray[np.uint8], float]:
    """The map in soft grays (h, w), and the number of cells along the side of a pixel."""
    cells = gray_image(grid, SOFT_GRAYS)
    longest = max(cells.shape)
    if longest <= MAX_PIXELS:
        zoom = math.ceil(MIN_PIXELS / longest)
        return cells.repeat(zoom, axis=0).repeat(zoom, axis=1), 1 / zoom
    side = math.ceil(longest / MAX_PIXELS)
    height, width = -(-cells.shape[0] // side), -(-cells.shape[1] // side)
    # Padded above and to the right, so that the lower left corner keeps its place.
    above, right = height * side - cells.shape[0], width * side - cells.shape[1]
    padded = np.pad(cells, ((above, 0), (0, right)), constant_values=SOFT_GRAYS[UNKNOWN])
    blocks = padded.reshape(height, side, width, side)
    darkest, mean = blocks.min(axis=(1, 3)), blocks.mean(axis=(1, 3))
    return np.where(darkest == SOFT_GRAYS[OCCUPIED], darkest, np.round(mean)).astype(np.uint8), float(side)


def draw_cells(canvas: Canvas, cells: Mask, grid: OccupancyGrid, colour: Colour) -> None:
    """Colours cells (H, W) of the grid of a `map_canvas`, by a point in every pixel of them."""
    pixels = max(1, round(canvas.pixels_per_metre * grid.resolution))
    lines, columns = np.nonzero(cells)
    aside = (np.arange(pixels) + 0.5) / pixels
    inner = np.stack(np.meshgrid(aside, aside), axis=-1).reshape(-1, 2)
    corners = np.column_stack([columns, lines])[:, None, :]
    points = (corners + inner).reshape(-1, 2) * grid.resolution + np.array(grid.origin)
    canvas.cloud(points, colour, 1.0)


def _draw_graph(canvas: Canvas, graph: Graph) -> list[LegendEntry]:
    entries: list[LegendEntry] = []
    edges = edges_by_kind(graph)
    for kind, width in (("nScan", 1.2), ("pairwise", 1.2), ("loop", 2.0)):
        nodes, colour = edges[kind], EDGE_COLOURS[kind]
        if len(nodes):
            starts, ends = graph.poses[nodes[:, 0], :2], graph.poses[nodes[:, 1], :2]
            canvas.segments(starts, ends, colour, width)
            entries.append(("line", colour, kind))
    canvas.circles(graph.poses[graph.keyframes, :2], 1.8, BLACK)
    return [*entries, ("disc", BLACK, "keyframe")]


def _draw_uncertainty(canvas: Canvas, graph: Graph) -> list[LegendEntry]:
    keyframes = sorted(graph.marginals)
    if not keyframes:
        return []
    covariances = np.array([graph.marginals[keyframe][:2, :2] for keyframe in keyframes])
    return [draw_ellipses(canvas, graph.poses[keyframes, :2], covariances, PURPLE, MIN_ELLIPSE)]


def _points_of_occupied_cells(log: LaserLog, rows: Indices, poses: Array, grid: OccupancyGrid) -> Array:
    """(M, 2) the end points of beams in occupied cells, m."""
    seen = list(log.moving_along(poses, rows).points_by_scan())
    points = np.concatenate([transform(pose, seen[row]) for row, pose in zip(rows, poses, strict=True)])
    lines, columns = grid.cells_of(points)
    height, width = grid.shape
    inside = (columns >= 0) & (columns < width) & (lines >= 0) & (lines < height)
    points, columns, lines = points[inside], columns[inside], lines[inside]
    occupied: Array = points[grid.states()[lines, columns] == OCCUPIED]
    return occupied


def plot_removed(grid: OccupancyGrid, removed: Removed) -> Canvas:
    """The cleaned map in soft grays, with the removed cells in colour; a scale bar and a legend below."""
    canvas = map_canvas(grid)
    entries: list[LegendEntry] = []
    for name, colour, text in KINDS:
        cells = getattr(removed, name)
        draw_cells(canvas, cells, grid, colour)
        entries.append(("disc", colour, f"{text}: {np.count_nonzero(cells)} cells"))
    draw_scale_bar(canvas, entries)
    return canvas


class DrawnResult(NamedTuple):
    """One of two results in a common frame."""

    name: str
    grid: OccupancyGrid
    path: Array
    """(N, 2) m"""


def plot_comparison(first: DrawnResult, second: DrawnResult) -> Canvas:
    """Walls of both dark, walls of one alone in its colour, and both paths in theirs; names below.

    Walls agree where both have a cell within one cell: maps differ by that much by the raster alone.
    """
    from scipy import ndimage

    size = first.grid.resolution
    bounds = np.array([first.grid.bounds, second.grid.bounds]) / size
    left, bottom = np.round(bounds[:, :2].min(axis=0)).astype(int).tolist()
    right, top = np.round(bounds[:, 2:].max(axis=0)).astype(int).tolist()
    states = [_placed(drawn.grid, left, bottom, (top - bottom, right - left)) for drawn in (first, second)]
    walls = [state == OCCUPIED for state in states]
    around = np.ones((3, 3), dtype=np.bool_)
    alone = [
        wall & ~ndimage.binary_dilation(other, around) for wall, other in zip(walls, walls[::-1], strict=True)
    ]
    agreed = (walls[0] | walls[1]) & ~alone[0] & ~alone[1]
    free = (states[0] == FREE) | (states[1] == FREE) | alone[0] | alone[1]
    hits = np.where(agreed, 10, 0).astype(np.int32)
    corner = (left * size, bottom * size)
    both = grid_of_counts(hits, (free & ~agreed).astype(np.int32), size, corner)
    canvas = map_canvas(both)
    for drawn, cells, colour in ((first, alone[0], BLUE), (second, alone[1], VERMILLION)):
        draw_cells(canvas, cells, both, colour)
        canvas.line(drawn.path, colour, 1.2)
    draw_scale_bar(canvas, [("line", BLUE, first.name), ("line", VERMILLION, second.name)])
    return canvas


def _placed(grid: OccupancyGrid, left: int, bottom: int, shape: tuple[int, int]) -> NDArray[np.int8]:
    """The states of a grid in a larger one, whose lower left corner is at (left, bottom) cells."""
    states = np.full(shape, -1, dtype=np.int8)
    column, line = (round(at / grid.resolution) for at in grid.origin)
    height, width = grid.shape
    rows = slice(line - bottom, line - bottom + height)
    states[rows, column - left : column - left + width] = grid.states()
    return states
