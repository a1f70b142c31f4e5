"""Where a trajectory is wrong: its worst relations, or its distance from a reference trajectory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.figures.axes import CAPTION_MARGINS, Entry, caption
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, VERMILLION, WHITE, Canvas
from nscan_cli.mapping.figures.colour_ramp import ramp
from nscan_cli.mapping.figures.labels import RADIUS, TEXT, number_places
from nscan_cli.mapping.figures.panels import SLIMMEST, bounds_around, panel
from nscan_cli.poses import Array

MOST_LISTED = 20
"""Relations that are numbered and listed beside the plot, where there is room; of others, see the lines."""
LIST_WIDTH, LIST_STEP = 215.0, 27.0
"""Units."""
REFERENCE = (190, 190, 190)
CLASSES = 16
"""Colours of the error."""
MOST_SHARE = 0.99
"""Share of the errors that the colours tell apart; larger ones have the last colour."""
LEAST_ERROR = 1e-6
"""m of the last colour at least."""


def plot_relations(
    poses: Array, pairs: NDArray[np.int64], errors: Array, title: str, beside: bool = False
) -> Canvas:
    """Relations drawn over the trajectory `poses` (N, 3) as lines between their two poses.

    `pairs` (W, 2) are rows of poses, `errors` (W, 2) the relations' errors in m and degrees, in the order
    that they are numbered in.
    """
    margin = LIST_WIDTH if len(pairs) else CAPTION_MARGINS[2]
    canvas = panel(bounds_around(poses[:, :2], SLIMMEST, 0.04), beside, margin)
    canvas.line(poses[:, :2], BLUE, 1.6)
    entries: list[Entry] = [("line", BLUE, "trajectory")]
    if len(pairs):
        ends = poses[pairs, :2]
        canvas.segments(ends[:, 0], ends[:, 1], VERMILLION, 3.0)
        canvas.circles(ends.reshape(-1, 2), 4.0, VERMILLION)
        number_places(canvas, ends[: _listed(canvas)].mean(axis=1), poses[:, :2], VERMILLION)
        entries.append(("line", VERMILLION, f"worst relations ({len(pairs)})"))
    caption(canvas, title, entries)
    _list(canvas, errors)
    return canvas


def plot_against(
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
    canvas = panel(bounds_around(both, SLIMMEST, 0.04), beside)
    canvas.line(reference[:, :2], REFERENCE, 8.0)
    canvas.line(poses[:, :2], BLACK, 1.0)
    most = float(f"{max(float(np.quantile(errors, MOST_SHARE)), LEAST_ERROR):.1e}")
    classes = np.minimum(errors / most * CLASSES, CLASSES - 1).astype(np.int64)
    # The worst last, so that no other hides them.
    for number, colour in enumerate(ramp(CLASSES)):
        canvas.dots(poses[rows[classes == number], :2], 2.4, colour)
    beyond = " and more" if errors.max() > most else ""
    caption(
        canvas,
        title,
        [("line", REFERENCE, "reference"), ("ramp", BLACK, f"result, error 0 to {most:g} m{beyond}")],
    )
    return canvas


def _listed(canvas: Canvas) -> int:
    """How many relations the list has room for, with a line for the others."""
    _left, top, _right, bottom = canvas.plot
    return min(MOST_LISTED, int((bottom - top) / (canvas.unit * LIST_STEP)) - 1)


def _list(canvas: Canvas, errors: Array) -> None:
    """The numbers of the worst relations and their errors (W, 2), beside the plot."""
    listed = _listed(canvas)
    _left, top, right, _bottom = canvas.plot
    unit = canvas.unit
    x, y = right + 22 * unit, top + 0.5 * LIST_STEP * unit
    for number, (metres, degrees) in enumerate(errors[:listed].tolist(), start=1):
        canvas.pixel_ovals(np.array([[x, y]]), np.array([RADIUS, RADIUS]), WHITE, VERMILLION)
        canvas.text((x, y), str(number), "mm", TEXT)
        canvas.text((x + 102 * unit, y), f"{metres:.3f} m", "rm")
        canvas.text((x + 165 * unit, y), f"{degrees:.1f}°", "rm")
        y += LIST_STEP * unit
    if len(errors) > listed:
        canvas.text((x - RADIUS * unit, y), f"and {len(errors) - listed} more", "lm")
