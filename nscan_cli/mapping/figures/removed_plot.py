"""A picture of what cleaning has removed from a map."""

from __future__ import annotations

import numpy as np

from nscan_cli.mapping.cleaning import Removed
from nscan_cli.mapping.figures.axes import SCALE_BAR_MARGINS, LegendEntry, draw_scale_bar
from nscan_cli.mapping.figures.canvas import PURPLE, SKY, VERMILLION, Canvas
from nscan_cli.mapping.figures.map_plots import background_image, points_of_cells
from nscan_cli.mapping.occupancy import OccupancyGrid

KINDS = (("unconnected", SKY, "not connected"), ("specks", VERMILLION, "specks"), ("gone", PURPLE, "gone"))


def plot_removed(grid: OccupancyGrid, removed: Removed) -> Canvas:
    """The cleaned map in soft grays, with the removed cells in colour; a scale bar and a legend below."""
    background, cells_per_pixel = background_image(grid)
    canvas = Canvas(grid.bounds, 1 / (cells_per_pixel * grid.resolution), background, SCALE_BAR_MARGINS)
    entries: list[LegendEntry] = []
    for name, colour, text in KINDS:
        cells = getattr(removed, name)
        canvas.cloud(points_of_cells(cells, grid, max(1, round(1 / cells_per_pixel))), colour, 1.0)
        entries.append(("disc", colour, f"{text}: {np.count_nonzero(cells)} cells"))
    draw_scale_bar(canvas, entries)
    return canvas
