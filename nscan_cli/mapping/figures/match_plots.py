"""Scans before and after a match, as the paper's Figs. 4 and 5: points, and circles at the robot's poses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.counting import counted
from nscan_cli.mapping.figures.axes import LegendEntry, draw_title_and_legend
from nscan_cli.mapping.figures.canvas import BLACK, BLUE, GRAY, PURPLE, VERMILLION, Bounds, Canvas, Colour
from nscan_cli.mapping.figures.colormap import plasma
from nscan_cli.mapping.figures.covariance_ellipses import draw_ellipses
from nscan_cli.mapping.figures.panels import (
    MIN_ASPECT,
    bounds_around,
    hstack_images,
    is_wide,
    panel,
    stacked_panels,
    vstack_images,
)
from nscan_cli.mapping.figures.symbols import draw_crosses, draw_robots
from nscan_cli.matching.joint.nscan_match import NScanMatch
from nscan_cli.matching.joint.outliers import ExcludedScan
from nscan_cli.matching.pairwise import PairMatch
from nscan_cli.poses import Array, transform

if TYPE_CHECKING:
    from PIL.Image import Image

DOT_RADIUS, ROBOT_RADIUS = 2.2, 8.0
"""Radii, units."""
POINT_OPACITY = 170
MAX_NAMED_SCANS = 6
"""Scans that are named one by one; of more, the first and the last."""
VIEW_MARGIN = 0.5
"""Share of the picture's longer side that a scan that was left out may lie beyond the others to be shown."""
MIN_PAIR_ELLIPSE = 26.0
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
    draw_title_and_legend(before, f"before: {_pose_text(start)}", scans)
    draw_title_and_legend(
        after, f"after: {_pose_text(match.pose)}, overlap {match.overlap:.0%}{outcome}", known
    )
    join = hstack_images if beside else vstack_images
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
    near = _in_bounds(gone, bounds_around(shown, 1.0, VIEW_MARGIN))
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
    return vstack_images([before.image(), after.image()])


def _in_bounds(points: Array, bounds: Bounds) -> NDArray[np.bool_]:
    """Which of the points (N, 2) lie within the bounds."""
    inside: NDArray[np.bool_] = np.all((points >= bounds[:2]) & (points <= bounds[2:]), axis=1)
    return inside


def scan_legend(names: Sequence[str]) -> list[LegendEntry]:
    """What the colours of scans stand for."""
    if len(names) > MAX_NAMED_SCANS:
        return [("ramp", BLACK, f"scans {names[0]} to {names[-1]}")]
    return [("robot", colour, f"scan {name}") for colour, name in zip(plasma(len(names)), names, strict=True)]


def excluded_legend(names: Sequence[str], near: NDArray[np.bool_]) -> list[LegendEntry]:
    """The scans that were left out: those in the picture, and those too far off."""
    entries: list[LegendEntry] = []
    for seen, colour, meaning in ((True, BLACK, "left out"), (False, GRAY, "left out, not in view")):
        named = [name for name, is_near in zip(names, near.tolist(), strict=True) if is_near == seen]
        if named:
            more = f" and {len(named) - MAX_NAMED_SCANS} more" if len(named) > MAX_NAMED_SCANS else ""
            entries.append(("cross", colour, f"{meaning}: {', '.join(named[:MAX_NAMED_SCANS])}{more}"))
    return entries


def _draw_robot(canvas: Canvas, pose: Array, colour: Colour) -> None:
    draw_robots(canvas, canvas.pixels(pose[None, :2]), pose[None, 2], ROBOT_RADIUS, colour)


def _pose_text(pose: Array) -> str:
    # 0.0 is added since a small negative number would be told as -0.
    x, y = (np.round(pose[:2], 3) + 0.0).tolist()
    return f"{x:.3f} m, {y:.3f} m, {round(math.degrees(pose[2]), 2) + 0.0:.2f}°"
