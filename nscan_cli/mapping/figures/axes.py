"""Axes in metres, scale bars, titles and legends."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nscan_cli.mapping.figures.canvas import BLACK, TEXT_SIZE, Canvas, Colour
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.symbols import draw_crosses, draw_robots

LegendEntry = tuple[str, Colour, str]
"""Shape (line, disc, robot, cross, ellipse, or ramp for a whole colour map), colour, meaning."""
AXES_MARGINS = (64.0, 44.0, 24.0, 64.0)
"""Margins for `draw_axes`, units."""
TITLE_MARGINS = (64.0, 48.0, 24.0, 92.0)
"""Margins for `draw_title_and_legend` and `draw_legend_below`, units."""
SCALE_BAR_MARGINS = (0.0, 0.0, 0.0, 44.0)
"""Margins for `draw_scale_bar`, units."""
SYMBOL_GAP, ENTRY_GAP = 8.0, 22.0
"""Distances from a symbol to its meaning, and from there to the next symbol, units."""
MIN_TEXT_SCALE = 0.1
"""Text that would have to shrink below this share of its size is left out."""
RAMP_STEPS = 14


def draw_axes(canvas: Canvas) -> None:
    """Draws a frame around the plot, with ticks and numbers in metres."""
    left, top, right, bottom = canvas.plot
    low_x, low_y, high_x, high_y = canvas.bounds
    unit = canvas.unit
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]])
    canvas.pixel_lines(corners[None].astype(np.float64), BLACK, 1.2)
    step = round_length(max(high_x - low_x, high_y - low_y) / 5)
    for x in _multiples(step, low_x, high_x):
        at = float(canvas.pixels(np.array([x, low_y]))[0])
        canvas.pixel_lines(np.array([[[at, bottom], [at, bottom - 7 * unit]]]), BLACK, 1.2)
        canvas.text((at, bottom + 9 * unit), f"{x:g}", "mt")
    for y in _multiples(step, low_y, high_y):
        at = float(canvas.pixels(np.array([low_x, y]))[1])
        canvas.pixel_lines(np.array([[[left, at], [left + 7 * unit, at]]]), BLACK, 1.2)
        canvas.text((left - 9 * unit, at), f"{y:g}", "rm")
    canvas.text(((left + right) / 2, bottom + 35 * unit), "x (m)", "mt")
    canvas.text((left, top - 12 * unit), "y (m)", "mb")


def draw_title_and_legend(canvas: Canvas, title: str, entries: Sequence[LegendEntry]) -> None:
    """Clears the margins; draws axes, a title above the plot and a legend below it."""
    draw_legend_below(canvas, entries)
    left, top, right, _bottom = canvas.plot
    # The title starts beside "y (m)".
    start = left + 40 * canvas.unit
    shrunk = min(1.0, (right - start) / canvas.text_width(title))
    if shrunk < MIN_TEXT_SCALE:
        return
    size = TEXT_SIZE * shrunk
    x = max(start, (left + right - canvas.text_width(title, size)) / 2)
    canvas.text((x, top - 16 * canvas.unit), title, "ls", size)


def draw_legend_below(canvas: Canvas, entries: Sequence[LegendEntry]) -> None:
    """Clears the margins; draws axes, and a legend below the plot."""
    left, _top, right, bottom = canvas.plot
    canvas.clear_margins()
    draw_axes(canvas)
    draw_legend(canvas, entries, left, right, bottom + 72 * canvas.unit, 0.5)


def draw_scale_bar(canvas: Canvas, entries: Sequence[LegendEntry]) -> None:
    """Draws a scale bar and a legend below the plot."""
    left, _top, right, bottom = canvas.plot
    unit, y = canvas.unit, bottom + 22 * canvas.unit
    length = round_length((canvas.bounds[2] - canvas.bounds[0]) / 8)
    start = left + 14 * unit
    end = start + length * canvas.pixels_per_metre
    canvas.pixel_lines(np.array([[[start, y], [end, y]]]), BLACK, 2)
    ends = np.array([[[x, y - 5 * unit], [x, y + 5 * unit]] for x in (start, end)])
    canvas.pixel_lines(ends, BLACK, 2)
    scale = f"{length:g} m"
    canvas.text((end + 9 * unit, y), scale)
    draw_legend(canvas, entries, end + canvas.text_width(scale) + 28 * unit, right - 14 * unit, y)


def draw_legend(
    canvas: Canvas, entries: Sequence[LegendEntry], left: float, right: float, y: float, align: float = 1.0
) -> None:
    """Draws a legend in a line at `y`, between `left` and `right`, all in pixels.

    It shrinks where there is little room, and is left out where it would be too small to read. `align` is
    the share of the remaining room that is on its left.
    """
    needed = sum(
        canvas.text_width(entry[2]) + (_symbol_width(entry) + SYMBOL_GAP + ENTRY_GAP) * canvas.unit
        for entry in entries
    )
    needed -= ENTRY_GAP * canvas.unit
    shrunk = min(1.0, (right - left) / max(needed, 1.0))
    if shrunk < MIN_TEXT_SCALE:
        return
    size, unit = TEXT_SIZE * shrunk, canvas.unit * shrunk
    x = left + align * (right - left - shrunk * needed)
    for entry in entries:
        _draw_symbol(canvas, entry, x, y, unit)
        x += (_symbol_width(entry) + SYMBOL_GAP) * unit
        canvas.text((x, y), entry[2], size=size)
        x += canvas.text_width(entry[2], size) + ENTRY_GAP * unit


def round_length(length: float) -> float:
    """The greatest of …, 1, 2, 5, 10, 20, … that is at most `length`."""
    power = 10.0 ** math.floor(math.log10(length))
    return next(factor * power for factor in (5, 2, 1) if factor * power <= length * (1 + 1e-9))


def _symbol_width(entry: LegendEntry) -> float:
    """Width of the symbol, units."""
    return 70.0 if entry[0] == "ramp" else 28.0


def _draw_symbol(canvas: Canvas, entry: LegendEntry, x: float, y: float, unit: float) -> None:
    """Draws the symbol from x to the right; `unit` is in pixels."""
    shape, colour, _meaning = entry
    width = _symbol_width(entry)
    middle = np.array([[x + width / 2 * unit, y]])
    shrunk = unit / canvas.unit
    if shape == "line":
        canvas.pixel_lines(np.array([[[x, y], [x + width * unit, y]]]), colour, 3)
    elif shape == "ramp":
        edges = np.linspace(x, x + width * unit, RAMP_STEPS + 1)
        for start, end, step in zip(edges[:-1], edges[1:], plasma(RAMP_STEPS), strict=True):
            canvas.pixel_lines(np.array([[[start, y], [end, y]]]), step, 12 * shrunk)
    elif shape == "disc":
        canvas.pixel_ovals(middle, np.array([5.0, 5.0]) * shrunk, colour)
    elif shape == "robot":
        draw_robots(canvas, middle, np.zeros(1), 7 * shrunk, colour)
    elif shape == "cross":
        draw_crosses(canvas, middle, 6 * shrunk, colour)
    else:
        canvas.pixel_ovals(middle, np.array([12.0, 7.0]) * shrunk, (*colour[:3], 60), colour)


def _multiples(step: float, low: float, high: float) -> list[float]:
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
