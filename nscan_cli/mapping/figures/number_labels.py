"""Placement of number labels near their anchors, clear of each other and of a line."""

from __future__ import annotations

import numpy as np

from nscan_cli.mapping.figures.canvas import GRAY, WHITE, Canvas, Colour
from nscan_cli.poses import Array

LABEL_RADIUS, LABEL_TEXT_SIZE = 11.0, 15.0
"""Radius of a label and size of its number, units."""
LABEL_DISTANCES = (22.0, 32.0, 46.0, 64.0, 86.0, 112.0)
"""Candidate distances from an anchor to its label, units, in ascending order."""
LABEL_DIRECTIONS = 16
MAX_LINE_POINTS = 4000
"""Largest number of points of the line that is kept clear."""


def draw_number_labels(canvas: Canvas, places: Array, clear: Array, colour: Colour) -> None:
    """Draws labels 1, 2, … beside `places` (N, 2), where they hide least of a line through `clear` (M, 2).

    Both are in metres. Lines lead from the places to their labels.
    """
    angles = np.arange(LABEL_DIRECTIONS) * (2 * np.pi / LABEL_DIRECTIONS)
    around = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    asides = np.concatenate([distance * around for distance in LABEL_DISTANCES]) * canvas.unit
    line = canvas.pixels(clear[:: -(-len(clear) // MAX_LINE_POINTS)])
    radius = LABEL_RADIUS * canvas.unit
    anchors, labels = canvas.pixels(places), np.empty((0, 2))
    for anchor in anchors:
        candidates = _within_plot(canvas, anchor + asides, radius)
        if len(candidates) == 0:
            candidates = anchor[None]
        cost = np.hypot(*(candidates - anchor).T) / radius
        cost += 1000 * _count_near(candidates, labels, 2.2 * radius)
        cost += 100 * _count_near(candidates, anchors, 1.5 * radius)
        cost += 0.5 * np.minimum(_count_near(candidates, line, 1.2 * radius), 12)
        labels = np.concatenate([labels, candidates[np.argmin(cost)][None]])
    canvas.pixel_lines(np.stack([anchors, labels], axis=1), GRAY, 1.0)
    canvas.pixel_ovals(labels, np.array([LABEL_RADIUS, LABEL_RADIUS]), WHITE, colour)
    for number, (x, y) in enumerate(labels.tolist(), start=1):
        canvas.text((x, y), str(number), "mm", LABEL_TEXT_SIZE)


def _within_plot(canvas: Canvas, pixels: Array, radius: float) -> Array:
    left, top, right, bottom = canvas.plot
    x, y = pixels.T
    within = (x > left + radius) & (x < right - radius) & (y > top + radius) & (y < bottom - radius)
    inside: Array = pixels[within]
    return inside


def _count_near(candidates: Array, others: Array, distance: float) -> Array:
    """(C,) the number of `others` (M, 2) nearer than `distance` to each of the candidates (C, 2)."""
    apart = np.hypot(*np.moveaxis(candidates[:, None] - others[None], -1, 0))
    count: Array = (apart < distance).sum(axis=1).astype(np.float64)
    return count
