"""Uncertainty as ellipses, enlarged where they would be too small to see, and then said to be so."""

from __future__ import annotations

import math

import numpy as np

from nscan_cli.mapping.figures.axes import LegendEntry
from nscan_cli.mapping.figures.canvas import Canvas, Colour
from nscan_cli.poses import Array

ELLIPSE_SIGMAS = 3.0
MAX_ENLARGEMENT = 1000.0
"""Times that an ellipse is enlarged at most."""


def draw_ellipses(
    canvas: Canvas, centres: Array, covariances: Array, colour: Colour, seen: float
) -> LegendEntry:
    """Ellipses of ELLIPSE_SIGMAS standard deviations of covariances (N, 2, 2), m², around (N, 2), m.

    Where the longest half axis of all has less than `seen` units, all are enlarged alike. Returns the
    entry for the legend, which tells.
    """
    largest = ELLIPSE_SIGMAS * math.sqrt(float(np.linalg.eigvalsh(covariances).max()))
    wanted = seen * canvas.unit / canvas.pixels_per_metre
    times = min(MAX_ENLARGEMENT, _round_factor(wanted / largest)) if largest > 0 else 1.0
    canvas.ellipses(centres, covariances, ELLIPSE_SIGMAS * times, colour)
    enlarged = f", enlarged {times:g} times" if times > 1 else ""
    return "ellipse", colour, f"{ELLIPSE_SIGMAS:g} sigma{enlarged}"


def _round_factor(factor: float) -> float:
    """The least of 1, 2, 5, 10, 20, … that is not smaller."""
    if factor <= 1:
        return 1.0
    power = 10.0 ** math.floor(math.log10(factor))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= factor * (1 - 1e-9))
