"""Where a trajectory is wrong: its worst relations, or its distance from a reference trajectory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.figures.axes import TITLE_MARGINS, LegendEntry, draw_title_and_legend
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, VERMILLION, WHITE, Canvas
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.number_labels import LABEL_RADIUS, LABEL_TEXT_SIZE, draw_number_labels
from nscan_cli.mapping.figures.panels import MIN_ASPECT, bounds_around, panel
from nscan_cli.poses import Array

MAX_LISTED = 20
"""Relations that are numbered and listed beside the plot, where there is room; of others, see the lines."""
LIST_WIDTH, LIST_LINE_HEIGHT = 215.0, 27.0
"""Units."""
REFERENCE_COLOUR = (190, 190, 190)
COLOUR_CLASSES = 16
"""Colours of the error."""
COLOUR_QUANTILE = 0.99
"""Share of the errors that the colours tell apart; larger ones have the last colour."""
MIN_COLOUR_RANGE = 1e-6
"""m of the last colour at least."""


def plot_relations(
    poses: Array, pairs: NDArray[np.int64], errors: Array, title: str, beside: bool = False
) -> Canvas:
    """Relations drawn over the trajectory `poses` (N, 3) as lines between their two poses.

    `pairs` (W, 2) are rows of poses, `errors` (W, 2) the relations' errors in m and degrees, in the order
    that they are numbered in.
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
    poses: Array,
    rows: NDArray[np.int64],
    errors: Array,
    reference: Array,
    title: str,
    beside: bool = False,
) -> Canvas:
    """A trajectory `poses` (N, 3), aligned to the `reference` (M, 3), and its error in colours.

    `errors` (K,), m, are those of the poses in `rows` (K,).
    """
    both = np.concatenate([poses[:, :2], reference[:, :2]])
    canvas = panel(bounds_around(both, MIN_ASPECT, 0.04), beside)
    canvas.line(reference[:, :2], REFERENCE_COLOUR, 8.0)
    canvas.line(poses[:, :2], BLACK, 1.0)
    most = float(f"{max(float(np.quantile(errors, COLOUR_QUANTILE)), MIN_COLOUR_RANGE):.1e}")
    classes = np.minimum(errors / most * COLOUR_CLASSES, COLOUR_CLASSES - 1).astype(np.int64)
    # The worst last, so that no other hides them.
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
    """How many relations the list has room for, with a line for the others."""
    _left, top, _right, bottom = canvas.plot
    return min(MAX_LISTED, int((bottom - top) / (canvas.unit * LIST_LINE_HEIGHT)) - 1)


def _draw_list(canvas: Canvas, errors: Array) -> None:
    """The numbers of the worst relations and their errors (W, 2), beside the plot."""
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
