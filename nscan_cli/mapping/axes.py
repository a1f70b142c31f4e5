"""What tells the reader of a picture its scale and its colours: axes in metres, and a legend."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nscan_cli.mapping.canvas import BLACK, TEXT_SIZE, Canvas, Colour

AXES_MARGINS = (64.0, 44.0, 24.0, 64.0)
"""What `axes` needs around the plot, units."""
FOOTER_MARGINS = (0.0, 0.0, 0.0, 44.0)
"""What `footer` needs."""


def axes(canvas: Canvas) -> None:
    """A frame around the plot, with ticks and numbers in metres."""
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


def footer(canvas: Canvas, entries: Sequence[tuple[str, Colour, str]]) -> None:
    """A scale and a legend below the plot.

    An entry is a shape ("line", "disc" or "ellipse"), its colour, and what it stands for.
    """
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
    room = right - end - canvas.text_width(scale) - 60 * unit
    needed = sum(canvas.text_width(meaning) + 54 * unit for _shape, _colour, meaning in entries)
    size = TEXT_SIZE * min(1.0, room / max(needed, 1.0))
    shrunk = unit * size / TEXT_SIZE
    x = right - 14 * unit
    for shape, colour, meaning in reversed(entries):
        x -= canvas.text_width(meaning, size)
        canvas.text((x, y), meaning, size=size)
        x -= 36 * shrunk
        _symbol(canvas, shape, x, y, shrunk, colour)
        x -= 18 * shrunk


def round_length(length: float) -> float:
    """The greatest of …, 1, 2, 5, 10, 20, … that is not longer."""
    power = 10.0 ** math.floor(math.log10(length))
    return next(factor * power for factor in (5, 2, 1) if factor * power <= length * (1 + 1e-9))


def _symbol(canvas: Canvas, shape: str, x: float, y: float, unit: float, colour: Colour) -> None:
    """A symbol of 28 units (of so many pixels) from x to the right."""
    middle = np.array([[x + 14 * unit, y]])
    shrunk = unit / canvas.unit
    if shape == "line":
        canvas.pixel_lines(np.array([[[x, y], [x + 28 * unit, y]]]), colour, 3)
    elif shape == "disc":
        canvas.pixel_ovals(middle, np.array([5.0, 5.0]) * shrunk, colour)
    else:
        canvas.pixel_ovals(middle, np.array([12.0, 7.0]) * shrunk, (*colour[:3], 60), colour)


def _multiples(step: float, low: float, high: float) -> list[float]:
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
