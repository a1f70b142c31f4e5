"""Plots put together: what part of the plane they show, and pictures in rows and columns."""

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
"""Of the longer side of the plots of a picture together: 20 cm at 300 dots an inch."""
MAX_STACKED_HEIGHT = 1600
"""Pixels; of each of two stacked panels at most."""
WIDE_RATIO = 1.5
"""Width of a wide panel, measured by its height."""
MIN_ASPECT = 0.35
"""Share of a panel's longer side that the shorter has at least."""


def is_wide(bounds: Bounds) -> bool:
    """Whether panels of these bounds are better stacked than side by side."""
    return bounds[2] - bounds[0] > WIDE_RATIO * (bounds[3] - bounds[1])


def panel(bounds: Bounds, beside: bool = False, right: float = TITLE_MARGINS[2]) -> Canvas:
    """An empty panel with room for a caption, and a margin of `right` units on the right.

    One of two `beside` each other has half the pixels, and larger text and symbols for it.
    """
    left, top, _right, bottom = TITLE_MARGINS
    pixels, scale = (PLOT_PIXELS // 2, 1.5) if beside else (PLOT_PIXELS, 1.0)
    return Canvas.blank(bounds, pixels, (left, top, right, bottom), scale)


def stacked_panels(bounds: Bounds) -> tuple[Canvas, Canvas]:
    """Two empty panels with room for captions that make a picture of moderate height when stacked."""
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    pixels = min(PLOT_PIXELS, round(MAX_STACKED_HEIGHT * max(width, height) / height))
    above, below = (Canvas.blank(bounds, pixels, TITLE_MARGINS) for _ in range(2))
    return above, below


def hstack_images(pictures: Sequence[Image]) -> Image:
    """Pictures in a row on white."""
    from PIL import Image

    row = Image.new("RGB", (sum(p.width for p in pictures), max(p.height for p in pictures)), WHITE)
    left = 0
    for picture in pictures:
        row.paste(picture, (left, 0))
        left += picture.width
    return row


def vstack_images(pictures: Sequence[Image]) -> Image:
    """Pictures in a column on white."""
    from PIL import Image

    column = Image.new("RGB", (max(p.width for p in pictures), sum(p.height for p in pictures)), WHITE)
    top = 0
    for picture in pictures:
        column.paste(picture, (0, top))
        top += picture.height
    return column


def bounds_around(points: Array, least: float = 0.0, spare: float = 0.02) -> Bounds:
    """The bounds of points (N, 2) with a share `spare` of the longer side around them.

    The shorter side has at least the share `least` of the longer, and the points in its middle.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    longer = max(float((high - low).max()), 1e-3)
    lacking = np.maximum(least * longer - (high - low), 0) / 2 + spare * longer
    (low_x, low_y), (high_x, high_y) = (low - lacking).tolist(), (high + lacking).tolist()
    return low_x, low_y, high_x, high_y
