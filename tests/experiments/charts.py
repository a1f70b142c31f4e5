"""Charts in the style of the project's pictures: lines over a number, and images of values over two."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.figures.axes import LegendEntry, draw_legend, round_length
from nscan_cli.mapping.figures.canvas import (
    BLACK,
    BLUE,
    GREEN,
    PURPLE,
    SKY,
    TEXT_SIZE,
    VERMILLION,
    Bounds,
    Canvas,
    Colour,
)
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from PIL.Image import Image

ORANGE = (230, 159, 0)
COLOURS = (BLUE, VERMILLION, GREEN, BLACK, PURPLE, ORANGE, SKY)
PIXELS = 1200
"""Of the longer side of a chart without its margins."""
BESIDE_SCALE = 1.6
"""How much larger text and lines are in one of two charts beside each other."""
SHAPE = 0.62
MARGINS = (76.0, 84.0, 24.0, 96.0)
"""Left, top, right, bottom, units."""
SPARE = 0.05
"""Margin around the values, as a share of their range."""
MOST_DOTTED = 30
"""Points of a line that are marked one by one at most."""
GRID = (222, 222, 222)


class Plane:
    """An empty chart: a frame with ticks, and data as places in the picture, in pixels."""

    def __init__(self, canvas: Canvas, bounds: Bounds) -> None:
        """`bounds` are those of the data: the least x and y, the greatest x and y."""
        self.canvas, self.bounds = canvas, bounds

    def places(self, x: Array, y: Array) -> Array:
        """Data (N,), (N,) as positions (N, 2), pixels."""
        left, top, right, bottom = self.canvas.plot
        low_x, low_y, high_x, high_y = self.bounds
        across = left + (x - low_x) / (high_x - low_x) * (right - left)
        up = bottom - (y - low_y) / (high_y - low_y) * (bottom - top)
        return np.stack([across, up], axis=-1)

    def grid(self) -> None:
        """Faint lines from the ticks through the plot."""
        low_x, low_y, high_x, high_y = self.bounds
        for x in ticks(low_x, high_x):
            self._lines(np.array([x, x]), np.array([low_y, high_y]), GRID, 1.0)
        for y in ticks(low_y, high_y):
            self._lines(np.array([low_x, high_x]), np.array([y, y]), GRID, 1.0)

    def frame(self, x_label: str, y_label: str, title: str, entries: Sequence[LegendEntry]) -> None:
        """The frame with numbers, labels, title and legend; it covers lines that leave the plot."""
        canvas, unit = self.canvas, self.canvas.unit
        canvas.clear_margins()
        left, top, right, bottom = canvas.plot
        low_x, low_y, high_x, high_y = self.bounds
        self._lines(
            np.array([low_x, high_x, high_x, low_x, low_x]),
            np.array([low_y, low_y, high_y, high_y, low_y]),
            BLACK,
            1.4,
        )
        for x in ticks(low_x, high_x):
            at = float(self.places(np.array([x]), np.array([low_y]))[0, 0])
            canvas.text((at, bottom + 9 * unit), f"{x:g}", "mt")
        for y in ticks(low_y, high_y):
            at = float(self.places(np.array([low_x]), np.array([y]))[0, 1])
            canvas.text((left - 9 * unit, at), f"{y:g}", "rm")
        canvas.text(((left + right) / 2, bottom + 36 * unit), x_label, "mt")
        canvas.text((left, top - 12 * unit), y_label, "lb")
        size = TEXT_SIZE * min(1.0, (right - left) / canvas.text_width(title))
        canvas.text(((left + right) / 2, top - 50 * unit), title, "ms", size)
        draw_legend(canvas, entries, left, right, bottom + 76 * unit, 0.5)

    def line(self, x: Array, y: Array, colour: Colour) -> None:
        """A line through data (N,), (N,); each point marked where there are few."""
        self._lines(x, y, colour, 3.0)
        if len(x) <= MOST_DOTTED:
            self.canvas.pixel_ovals(self.places(x, y), np.array([6.0, 6.0]), colour)

    def _lines(self, x: Array, y: Array, colour: Colour, width: float) -> None:
        self.canvas.pixel_lines(self.places(x, y)[None], colour, width)


def line_chart(
    series: Mapping[str, tuple[Array, Array]],
    x_label: str,
    y_label: str,
    title: str,
    shape: float = SHAPE,
    beside: bool = False,
) -> Image:
    """Lines through the points x (N,), y (N,) of each series, with a legend of their names.

    The y axis spans the values, and begins at 0 where that is not far. `shape` is the height of the plot,
    measured by its width. One of two charts `beside` each other has larger text.
    """
    xs = np.concatenate([x for x, _ in series.values()])
    low, high = _range(np.concatenate([y for _, y in series.values()]))
    canvas = Canvas.blank((0.0, 0.0, 1.0, shape), PIXELS, MARGINS, BESIDE_SCALE if beside else 1.0)
    # Marks at the ends of a line are not cut.
    spare = SPARE * float(np.ptp(xs)) if any(len(x) <= MOST_DOTTED for x, _ in series.values()) else 0.0
    plane = Plane(canvas, (float(xs.min()) - spare, low, float(xs.max()) + spare, high))
    plane.grid()
    entries: list[LegendEntry] = []
    for number, (name, (x, y)) in enumerate(series.items()):
        colour = COLOURS[number % len(COLOURS)]
        plane.line(x, y, colour)
        entries.append(("line", colour, name))
    plane.frame(x_label, y_label, title, entries)
    return canvas.image()


def heat_map(
    values: Array,
    bounds: Bounds,
    x_label: str,
    y_label: str,
    title: str,
    marks: Mapping[str, tuple[Colour, Array]],
) -> Image:
    """An image of the values (rows, columns) over bounds of the data: the lower, the darker.

    Row 0 is that of the least y. The marks are places (N, 2) of the data, ringed in a colour. It is as
    large as a line chart that stands beside it.
    """
    from PIL import Image

    low, high = float(values.min()), float(values.max())
    shades = np.round(255 * (values[::-1] - low) / (high - low)).astype(np.uint8)
    rows, columns = values.shape
    factor = PIXELS / max(rows, columns)
    size = (round(columns * factor), round(rows * factor))
    gray: NDArray[np.uint8] = np.asarray(Image.fromarray(shades).resize(size, Image.Resampling.BICUBIC))
    width, height = size
    canvas = Canvas((0.0, 0.0, float(width), float(height)), 1.0, gray, MARGINS, BESIDE_SCALE)
    plane = Plane(canvas, bounds)
    entries: list[LegendEntry] = []
    for name, (colour, places) in marks.items():
        # A ring is a disc of no opacity within.
        ring = plane.places(places[:, 0], places[:, 1])
        canvas.pixel_ovals(ring, np.array([13.0, 13.0]), (*colour, 0), colour)
        canvas.pixel_ovals(ring, np.array([11.5, 11.5]), (*colour, 0), colour)
        entries.append(("disc", colour, name))
    plane.frame(x_label, y_label, title, entries)
    return canvas.image()


def ticks(low: float, high: float) -> list[float]:
    """Round numbers from low to high, five to ten or so."""
    step = round_length((high - low) / 5)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 12) + 0.0 for k in range(first, last + 1)]


def _range(values: Array) -> tuple[float, float]:
    """The range of an axis: the values with a margin, and 0 where that is near."""
    low, high = float(values.min()), float(values.max())
    spare = SPARE * max(high - low, 1e-9)
    if 0 <= low < high - low:
        return 0.0, high + spare
    return low - spare, high + spare
