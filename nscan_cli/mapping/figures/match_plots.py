"""Scans before and after a match, as the paper's Figs. 4 and 5: points, and circles at the robot's poses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.counting import counted
from nscan_cli.mapping.figures.axes import Entry, caption
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, DIM, PURPLE, VERMILLION, Bounds, Canvas, Colour
from nscan_cli.mapping.figures.colour_ramp import ramp
from nscan_cli.mapping.figures.covariance_ellipses import draw_ellipses
from nscan_cli.mapping.figures.panels import (
    SLIMMEST,
    bounds_around,
    is_wide,
    panel,
    side_by_side,
    stacked,
    stacked_panels,
)
from nscan_cli.mapping.figures.symbols import crosses, robots
from nscan_cli.matching.joint.nscan_match import NScanMatch
from nscan_cli.matching.joint.outliers import ExcludedScan
from nscan_cli.matching.pairwise import PairMatch
from nscan_cli.poses import Array, transform

if TYPE_CHECKING:
    from PIL.Image import Image

DOT, CIRCLE = 2.2, 8.0
"""Radii, units."""
OPACITY = 170
NAMED = 6
"""Scans that are named one by one; of more, the first and the last."""
REACH = 0.5
"""Share of the picture's longer side that a scan that was left out may lie beyond the others to be shown."""
SEEN_ELLIPSE = 26.0
"""Units of the half axis of an ellipse that is seen around a circle."""


def plot_match(
    numbers: tuple[int, int], reference: Array, moving: Array, start: Array, match: PairMatch
) -> Image:
    """Two scans before and after their match, in the frame of the reference, with the uncertainty.

    `numbers` are the scans' numbers, `reference` (m, 2) and `moving` (k, 2) their points, each in the
    frame of its own robot, `start` (3,) is the relative pose that the match began with.
    """
    placed = [transform(pose, moving) for pose in (start, match.pose)]
    origins = np.array([[0.0, 0.0], start[:2], match.pose[:2]])
    bounds = bounds_around(np.concatenate([reference, *placed, origins]), SLIMMEST)
    beside = not is_wide(bounds)
    before, after = (panel(bounds, True), panel(bounds, True)) if beside else stacked_panels(bounds)
    for canvas, points in zip((before, after), placed, strict=True):
        canvas.dots(reference, DOT, (*BLUE, OPACITY))
        canvas.dots(points, DOT, (*VERMILLION, OPACITY))
    known: list[Entry] = []
    if match.covariance is not None:
        shape, colour, size = draw_ellipses(
            after, match.pose[None, :2], match.covariance[None, :2, :2], PURPLE, SEEN_ELLIPSE
        )
        known = [(shape, colour, f"position of scan {numbers[1]}: {size}")]
    for canvas, pose in ((before, start), (after, match.pose)):
        _robot(canvas, np.zeros(3), BLUE)
        _robot(canvas, pose, VERMILLION)
    scans: list[Entry] = [
        ("robot", BLUE, f"scan {numbers[0]} (reference)"),
        ("robot", VERMILLION, f"scan {numbers[1]}"),
    ]
    outcome = "" if match.reason is None else f", {match.reason}"
    caption(before, f"before: {_told(start)}", scans)
    caption(after, f"after: {_told(match.pose)}, overlap {match.overlap:.0%}{outcome}", known)
    join = side_by_side if beside else stacked
    return join([before.image(), after.image()])


def plot_nscan(
    numbers: Sequence[int],
    points: Sequence[Array],
    start: Array,
    match: NScanMatch,
    left_out: Sequence[ExcludedScan],
) -> Image:
    """Scans before and after their joint match; those that were left out are gray and before it only.

    `numbers` are the scans' numbers, `points` (m_i, 2) theirs in the frame of each robot, `start` (n, 3)
    the poses that the match began with.
    """
    kept, poses = list(match.kept), match.poses
    both = [
        transform(pose, points[scan])
        for stage in (start[kept], poses)
        for scan, pose in zip(kept, stage, strict=True)
    ]
    shown = np.concatenate([*both, start[kept, :2], poses[:, :2]])
    gone = start[[out.scan for out in left_out], :2]
    near = _inside(gone, bounds_around(shown, 1.0, REACH))
    bounds = bounds_around(np.concatenate([shown, gone[near]]), SLIMMEST)
    before, after = stacked_panels(bounds)
    for out in left_out:
        before.dots(transform(start[out.scan], points[out.scan]), DOT, (*DIM, OPACITY))
    for canvas, stage in ((before, start[kept]), (after, poses)):
        colours = ramp(len(kept))
        for colour, scan, pose in zip(colours, kept, stage, strict=True):
            canvas.dots(transform(pose, points[scan]), DOT, (*colour, OPACITY))
        for colour, pose in zip(colours, stage, strict=True):
            _robot(canvas, pose, colour)
    crosses(before, before.pixels(gone[near]), CIRCLE, BLACK)
    names = [str(number) for number in numbers]
    order = _order([names[scan] for scan in kept])
    missing = _missing([names[out.scan] for out in left_out], near)
    caption(before, "before", order + missing)
    outcome = counted(match.joint.iterations, "iteration") if match.reason is None else match.reason
    caption(after, f"after: {len(kept)} scans, least overlap {match.overlap.min():.0%}, {outcome}", order)
    return stacked([before.image(), after.image()])


def _inside(points: Array, bounds: Bounds) -> NDArray[np.bool_]:
    """Which of the points (N, 2) lie within the bounds."""
    inside: NDArray[np.bool_] = np.all((points >= bounds[:2]) & (points <= bounds[2:]), axis=1)
    return inside


def _order(names: Sequence[str]) -> list[Entry]:
    """What the colours of scans stand for."""
    if len(names) > NAMED:
        return [("ramp", BLACK, f"scans {names[0]} to {names[-1]}")]
    return [("robot", colour, f"scan {name}") for colour, name in zip(ramp(len(names)), names, strict=True)]


def _missing(names: Sequence[str], near: NDArray[np.bool_]) -> list[Entry]:
    """The scans that were left out: those in the picture, and those too far off."""
    entries: list[Entry] = []
    for seen, colour, meaning in ((True, BLACK, "left out"), (False, DIM, "left out, not in view")):
        named = [name for name, is_near in zip(names, near.tolist(), strict=True) if is_near == seen]
        if named:
            more = f" and {len(named) - NAMED} more" if len(named) > NAMED else ""
            entries.append(("cross", colour, f"{meaning}: {', '.join(named[:NAMED])}{more}"))
    return entries


def _robot(canvas: Canvas, pose: Array, colour: Colour) -> None:
    robots(canvas, canvas.pixels(pose[None, :2]), pose[None, 2], CIRCLE, colour)


def _told(pose: Array) -> str:
    # 0.0 is added since a small negative number would be told as -0.
    x, y = (np.round(pose[:2], 3) + 0.0).tolist()
    return f"{x:.3f} m, {y:.3f} m, {round(math.degrees(pose[2]), 2) + 0.0:.2f}°"
