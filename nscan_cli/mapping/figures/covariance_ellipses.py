"""Covariance ellipses, enlarged where they would be too small to see."""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.mapping.figures.axes import LegendEntry
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
    factor = min(MAX_ENLARGEMENT, _round_factor(wanted / largest)) if largest > 0 else 1.0
    canvas.ellipses(centres, covariances, ELLIPSE_SIGMAS * factor, colour)
    enlarged = f", enlarged {factor:g} times" if factor > 1 else ""
    return "ellipse", colour, f"{ELLIPSE_SIGMAS:g} sigma{enlarged}"


def _round_factor(factor: float) -> float:
    """The least of 1, 2, 5, 10, 20, … that is at least `factor`."""
    if factor <= 1:
        return 1.0
    power = 10.0 ** math.floor(math.log10(factor))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= factor * (1 - 1e-9))
