"""Panels: the bounds of plots, and pictures in rows and columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.mapping.figures.axes import TITLE_MARGINS
from nscan_cli.mapping.figures.canvas import WHITE, Bounds, Canvas
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from PIL.Image import Image

PLOT_PIXELS = 2400
"""Longer side of a picture, pixels: 20 cm at 300 dots an inch."""
MAX_STACKED_HEIGHT = 1600
"""Largest height of each of two stacked panels, pixels."""
WIDE_RATIO = 1.5
"""Panels with a larger ratio of width to height are stacked."""
MIN_ASPECT = 0.35
"""Least ratio of the shorter to the longer side of a panel."""


def is_wide(bounds: Bounds) -> bool:
    """Whether panels with these bounds are stacked, not side by side."""
    return bounds[2] - bounds[0] > WIDE_RATIO * (bounds[3] - bounds[1])


def panel(bounds: Bounds, beside: bool = False, right: float = TITLE_MARGINS[2]) -> Canvas:
    """An empty panel with room for a caption, and a margin of `right` units on the right.

    With `beside`, it is one of two in a row and has half the pixels, but larger text and symbols.
    """
    left, top, _right, bottom = TITLE_MARGINS
    pixels, scale = (PLOT_PIXELS // 2, 1.5) if beside else (PLOT_PIXELS, 1.0)
    return Canvas.blank(bounds, pixels, (left, top, right, bottom), scale)


def stacked_panels(bounds: Bounds) -> tuple[Canvas, Canvas]:
    """Two empty panels with room for captions, to be stacked."""
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    pixels = min(PLOT_PIXELS, round(MAX_STACKED_HEIGHT * max(width, height) / height))
    above, below = (Canvas.blank(bounds, pixels, TITLE_MARGINS) for _ in range(2))
    return above, below


def stack_images(pictures: Sequence[Image], beside: bool = False) -> Image:
    """Pictures on white in a column, or in a row with `beside`."""
    from PIL import Image

    widths, heights = [p.width for p in pictures], [p.height for p in pictures]
    size = (sum(widths), max(heights)) if beside else (max(widths), sum(heights))
    whole, at = Image.new("RGB", size, WHITE), 0
    for picture in pictures:
        whole.paste(picture, (at, 0) if beside else (0, at))
        at += picture.width if beside else picture.height
    return whole


def bounds_around(points: Array, least: float = 0.0, spare: float = 0.02) -> Bounds:
    """The bounds of points (N, 2), with `spare` times the longer side added on each side.

    The shorter side is at least `least` times the longer. The points lie in the middle.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    longer = max(float((high - low).max()), 1e-3)
    lacking = np.maximum(least * longer - (high - low), 0) / 2 + spare * longer
    (low_x, low_y), (high_x, high_y) = (low - lacking).tolist(), (high + lacking).tolist()
    return low_x, low_y, high_x, high_y
