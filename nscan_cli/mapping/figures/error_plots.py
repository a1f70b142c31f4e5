"""Plots of errors along a trajectory: its worst relations, or its distance from a reference."""

from __future__ import annotations

import numpy as np

from nscan_cli.mapping.figures.axes import TITLE_MARGINS, LegendEntry, draw_title_and_legend
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, GRAY, VERMILLION, WHITE, Canvas, Colour
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.panels import MIN_ASPECT, bounds_around, panel
from nscan_cli.poses import Array, Indices

MAX_LISTED = 20
"""Largest number of relations that are numbered and listed beside the plot."""
LIST_WIDTH, LIST_LINE_HEIGHT = 215.0, 27.0
"""Units."""
REFERENCE_COLOUR = (190, 190, 190)
COLOUR_CLASSES = 16
"""Number of colours of the error."""
COLOUR_QUANTILE = 0.99
"""Quantile of the errors from which on all have the last colour."""
MIN_COLOUR_RANGE = 1e-6
"""Least error with the last colour, m."""
LABEL_RADIUS, LABEL_TEXT_SIZE = 11.0, 15.0
"""Radius of a label and size of its number, units."""
LABEL_DISTANCES = (22.0, 32.0, 46.0, 64.0, 86.0, 112.0)
"""Candidate distances from an anchor to its label, units, in ascending order."""
LABEL_DIRECTIONS = 16
MAX_LINE_POINTS = 4000
"""Largest number of points of the line that is kept clear."""


def plot_relations(poses: Array, pairs: Indices, errors: Array, title: str, beside: bool = False) -> Canvas:
    """The worst relations as numbered lines over the trajectory `poses` (N, 3).

    `pairs` (W, 2) are rows of `poses`, `errors` (W, 2) the errors of the relations in m and degrees.
    """
    margin = LIST_WIDTH if len(pairs) else TITLE_MARGINS[2]
    canvas = panel(bounds_around(poses[:, :2], MIN_ASPECT, 0.04), beside, margin)
    canvas.line(poses[:, :2], BLUE, 1.6)
    entries: list[LegendEntry] = [("line", BLUE, "trajectory")]
    if len(pairs):
        ends = poses[pairs, :2]
        canvas.segments(ends[:, 0], ends[:, 1], VERMILLION, 3.0)
        canvas.circles(ends.reshape(-1, 2), 4.0, VERMILLION)
        draw_number_labels(canvas, ends[: _list_length(canvas)].mean(axis=1), poses[:, :2], VERMILLION)
        entries.append(("line", VERMILLION, f"worst relations ({len(pairs)})"))
    draw_title_and_legend(canvas, title, entries)
    _draw_list(canvas, errors)
    return canvas


def plot_against_reference(
    poses: Array, rows: Indices, errors: Array, reference: Array, title: str, beside: bool = False
) -> Canvas:
    """A trajectory `poses` (N, 3), aligned to the `reference` (M, 3), with its errors in colour.

    `errors` (K,) are the errors in m of the poses in `rows` (K,).
    """
    both = np.concatenate([poses[:, :2], reference[:, :2]])
    canvas = panel(bounds_around(both, MIN_ASPECT, 0.04), beside)
    canvas.line(reference[:, :2], REFERENCE_COLOUR, 8.0)
    canvas.line(poses[:, :2], BLACK, 1.0)
    most = float(f"{max(float(np.quantile(errors, COLOUR_QUANTILE)), MIN_COLOUR_RANGE):.1e}")
    classes = np.minimum(errors / most * COLOUR_CLASSES, COLOUR_CLASSES - 1).astype(np.int64)
    # The worst are drawn last, so that no others hide them.
    for number, colour in enumerate(plasma(COLOUR_CLASSES)):
        canvas.dots(poses[rows[classes == number], :2], 2.4, colour)
    beyond = " and more" if errors.max() > most else ""
    draw_title_and_legend(
        canvas,
        title,
        [("line", REFERENCE_COLOUR, "reference"), ("ramp", BLACK, f"result, error 0 to {most:g} m{beyond}")],
    )
    return canvas


def _list_length(canvas: Canvas) -> int:
    """The number of relations that the list has room for, with a last line for the others."""
    _left, top, _right, bottom = canvas.plot
    return min(MAX_LISTED, int((bottom - top) / (canvas.unit * LIST_LINE_HEIGHT)) - 1)


def _draw_list(canvas: Canvas, errors: Array) -> None:
    """Draws the numbers and the errors (W, 2) of the worst relations beside the plot."""
    listed = _list_length(canvas)
    _left, top, right, _bottom = canvas.plot
    unit = canvas.unit
    x, y = right + 22 * unit, top + 0.5 * LIST_LINE_HEIGHT * unit
    for number, (metres, degrees) in enumerate(errors[:listed].tolist(), start=1):
        canvas.pixel_ovals(np.array([[x, y]]), np.array([LABEL_RADIUS, LABEL_RADIUS]), WHITE, VERMILLION)
        canvas.text((x, y), str(number), "mm", LABEL_TEXT_SIZE)
        canvas.text((x + 102 * unit, y), f"{metres:.3f} m", "rm")
        canvas.text((x + 165 * unit, y), f"{degrees:.1f}°", "rm")
        y += LIST_LINE_HEIGHT * unit
    if len(errors) > listed:
        canvas.text((x - LABEL_RADIUS * unit, y), f"and {len(errors) - listed} more", "lm")


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
