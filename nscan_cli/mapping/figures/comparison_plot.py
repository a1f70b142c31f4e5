"""A picture of two maps of the same log over each other, with both paths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.figures.axes import draw_scale_bar
from nscan_cli.mapping.figures.canvas import BLUE, VERMILLION, Canvas
from nscan_cli.mapping.figures.map_plots import draw_cells, map_canvas
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, OccupancyGrid, grid_of_counts
from nscan_cli.poses import Array


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
