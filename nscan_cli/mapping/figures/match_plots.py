"""Scans before and after a match, as in Figs. 4 and 5 of the paper: points, and circles at the poses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.mapping.figures.axes import LegendEntry, draw_title_and_legend
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, GRAY, PURPLE, VERMILLION, Canvas, Colour
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.covariance_ellipses import draw_ellipses
from nscan_cli.mapping.figures.panels import (
    MIN_ASPECT,
    bounds_around,
    is_wide,
    panel,
    stack_images,
    stacked_panels,
)
from nscan_cli.mapping.figures.symbols import draw_crosses, draw_robots
from nscan_cli.matching.joint.nscan_match import NScanMatch
from nscan_cli.matching.joint.outliers import ExcludedScan
from nscan_cli.matching.pairwise import PairMatch
from nscan_cli.poses import Array, Mask, transform

if TYPE_CHECKING:
    from PIL.Image import Image

DOT_RADIUS, ROBOT_RADIUS = 2.2, 8.0
"""Units."""
POINT_OPACITY = 170
MAX_NAMED_SCANS = 6
"""Largest number of scans that are named one by one. Otherwise the first and the last are named."""
VIEW_MARGIN = 0.5
"""Excluded scans are shown up to this distance from the others, as a share of the longer side."""
MIN_PAIR_ELLIPSE = 26.0
"""Least half axis of an ellipse that is visible around a robot, units."""


def plot_match(
    numbers: tuple[int, int], reference: Array, moving: Array, start: Array, match: PairMatch
) -> Image:
    """Two scans before and after their match, in the frame of the reference, with the uncertainty.

    `numbers` are the numbers of the scans; `reference` (m, 2) and `moving` (k, 2) are their points in the
    frame of the robot; `start` (3,) is the initial relative pose.
    """
    placed = [transform(pose, moving) for pose in (start, match.pose)]
    origins = np.array([[0.0, 0.0], start[:2], match.pose[:2]])
    bounds = bounds_around(np.concatenate([reference, *placed, origins]), MIN_ASPECT)
    beside = not is_wide(bounds)
    before, after = (panel(bounds, True), panel(bounds, True)) if beside else stacked_panels(bounds)
    for canvas, points in zip((before, after), placed, strict=True):
        canvas.dots(reference, DOT_RADIUS, (*BLUE, POINT_OPACITY))
        canvas.dots(points, DOT_RADIUS, (*VERMILLION, POINT_OPACITY))
    known: list[LegendEntry] = []
    if match.covariance is not None:
        shape, colour, size = draw_ellipses(
            after, match.pose[None, :2], match.covariance[None, :2, :2], PURPLE, MIN_PAIR_ELLIPSE
        )
        known = [(shape, colour, f"position of scan {numbers[1]}: {size}")]
    for canvas, pose in ((before, start), (after, match.pose)):
        _draw_robot(canvas, np.zeros(3), BLUE)
        _draw_robot(canvas, pose, VERMILLION)
    scans: list[LegendEntry] = [
        ("robot", BLUE, f"scan {numbers[0]} (reference)"),
        ("robot", VERMILLION, f"scan {numbers[1]}"),
    ]
    outcome = "" if match.reason is None else f", {match.reason}"
    draw_title_and_legend(before, f"before: {_format_pose(start)}", scans)
    draw_title_and_legend(
        after, f"after: {_format_pose(match.pose)}, overlap {match.overlap:.0%}{outcome}", known
    )
    return stack_images([before.image(), after.image()], beside)


def plot_nscan(
    numbers: Sequence[int],
    points: Sequence[Array],
    start: Array,
    match: NScanMatch,
    left_out: Sequence[ExcludedScan],
) -> Image:
    """Scans before and after their joint match. Excluded scans are gray and appear only before it.

    `numbers` are the numbers of the scans, `points` (m_i, 2) their points in the frame of the robot,
    `start` (n, 3) the initial poses.
    """
    kept, poses = list(match.kept), match.poses
    both = [
        transform(pose, points[scan])
        for stage in (start[kept], poses)
        for scan, pose in zip(kept, stage, strict=True)
    ]
    shown = np.concatenate([*both, start[kept, :2], poses[:, :2]])
    gone = start[[out.scan for out in left_out], :2]
    view = bounds_around(shown, 1.0, VIEW_MARGIN)
    near: Mask = np.all((gone >= view[:2]) & (gone <= view[2:]), axis=1)
    bounds = bounds_around(np.concatenate([shown, gone[near]]), MIN_ASPECT)
    before, after = stacked_panels(bounds)
    for out in left_out:
        before.dots(transform(start[out.scan], points[out.scan]), DOT_RADIUS, (*GRAY, POINT_OPACITY))
    for canvas, stage in ((before, start[kept]), (after, poses)):
        colours = plasma(len(kept))
        for colour, scan, pose in zip(colours, kept, stage, strict=True):
            canvas.dots(transform(pose, points[scan]), DOT_RADIUS, (*colour, POINT_OPACITY))
        for colour, pose in zip(colours, stage, strict=True):
            _draw_robot(canvas, pose, colour)
    draw_crosses(before, before.pixels(gone[near]), ROBOT_RADIUS, BLACK)
    names = [str(number) for number in numbers]
    order = scan_legend([names[scan] for scan in kept])
    missing = excluded_legend([names[out.scan] for out in left_out], near)
    draw_title_and_legend(before, "before", order + missing)
    outcome = counted(match.joint.iterations, "iteration") if match.reason is None else match.reason
    draw_title_and_legend(
        after, f"after: {len(kept)} scans, least overlap {match.overlap.min():.0%}, {outcome}", order
    )
    return stack_images([before.image(), after.image()])


def scan_legend(names: Sequence[str]) -> list[LegendEntry]:
    """Legend entries of the matched scans."""
    if len(names) > MAX_NAMED_SCANS:
        return [("ramp", BLACK, f"scans {names[0]} to {names[-1]}")]
    return [("robot", colour, f"scan {name}") for colour, name in zip(plasma(len(names)), names, strict=True)]


def excluded_legend(names: Sequence[str], near: Mask) -> list[LegendEntry]:
    """Legend entries of the excluded scans; `near` (N,) tells which are in the picture."""
    entries: list[LegendEntry] = []
    for seen, colour, meaning in ((True, BLACK, "left out"), (False, GRAY, "left out, not in view")):
        named = [name for name, is_near in zip(names, near.tolist(), strict=True) if is_near == seen]
        if named:
            more = f" and {len(named) - MAX_NAMED_SCANS} more" if len(named) > MAX_NAMED_SCANS else ""
            entries.append(("cross", colour, f"{meaning}: {', '.join(named[:MAX_NAMED_SCANS])}{more}"))
    return entries


def _draw_robot(canvas: Canvas, pose: Array, colour: Colour) -> None:
    draw_robots(canvas, canvas.pixels(pose[None, :2]), pose[None, 2], ROBOT_RADIUS, colour)


def _format_pose(pose: Array) -> str:
    # Adding 0.0 turns -0 into 0.
    x, y = (np.round(pose[:2], 3) + 0.0).tolist()
    return f"{x:.3f} m, {y:.3f} m, {round(math.degrees(pose[2]), 2) + 0.0:.2f}°"
