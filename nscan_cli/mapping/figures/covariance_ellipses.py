"""Covariance ellipses, enlarged where they would be too small to see."""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.mapping.figures.axes import LegendEntry, round_length
from nscan_cli.mapping.figures.canvas import Canvas, Colour
from nscan_cli.poses import Array

ELLIPSE_SIGMAS = 3.0
MAX_ENLARGEMENT = 1000.0
"""Largest factor by which ellipses are enlarged."""


def draw_ellipses(
    canvas: Canvas, centres: Array, covariances: Array, colour: Colour, min_axis: float
) -> LegendEntry:
    """Ellipses of ELLIPSE_SIGMAS standard deviations of covariances (N, 2, 2), m², around (N, 2), m.

    If the longest half axis of all is below `min_axis` units, all are enlarged by one factor. Returns the
    legend entry, which names the factor.
    """
    largest = ELLIPSE_SIGMAS * math.sqrt(float(np.linalg.eigvalsh(covariances).max()))
    wanted = min_axis * canvas.unit / canvas.pixels_per_metre
    factor = min(MAX_ENLARGEMENT, 1 / round_length(min(largest / wanted, 1.0))) if largest > 0 else 1.0
    canvas.ellipses(centres, covariances, ELLIPSE_SIGMAS * factor, colour)
    enlarged = f", enlarged {factor:g} times" if factor > 1 else ""
    return "ellipse", colour, f"{ELLIPSE_SIGMAS:g} sigma{enlarged}"
