"""Symbols of robots and crosses; their size does not depend on the scale of the picture."""

from __future__ import annotations

import numpy as np

from nscan_cli.mapping.figures.canvas import WHITE, Canvas, Colour
from nscan_cli.poses import Array


def draw_robots(canvas: Canvas, centres: Array, headings: Array, radius: float, colour: Colour) -> None:
    """Draws circles at (N, 2) in pixels, of `radius` units, with a line along each heading (N,), rad."""
    unit = canvas.unit
    aside = np.stack([np.cos(headings), -np.sin(headings)], axis=-1) * radius * unit
    lines = np.stack([centres, centres + 2.1 * aside], axis=1)
    # A white edge separates them from points and from each other.
    canvas.pixel_lines(lines, WHITE, 0.4 * radius + 2)
    canvas.pixel_ovals(centres, np.array([radius, radius]), colour, WHITE)
    canvas.pixel_lines(lines, colour, 0.4 * radius)


def draw_crosses(canvas: Canvas, centres: Array, radius: float, colour: Colour) -> None:
    """Draws crosses at (N, 2) in pixels, of `radius` units."""
    for aside in ((radius, radius), (radius, -radius)):
        step = np.array(aside) * canvas.unit
        lines = np.stack([centres - step, centres + step], axis=1)
        canvas.pixel_lines(lines, WHITE, 0.4 * radius + 2)
        canvas.pixel_lines(lines, colour, 0.4 * radius)
