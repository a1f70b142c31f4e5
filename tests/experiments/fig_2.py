"""Fig. 2: three shapes. Any two of them match in two ways equally well, all three in one.

Each shape has a wall, which two shapes share at every shift along it, and strokes at three heights. At
each height two of the shapes have strokes, one of them two: so two shifts match them. The three pairs of
shifts do not go together but in one way.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.mapping.figures.axes import TITLE_MARGINS, LegendEntry, draw_title_and_legend
from nscan_cli.mapping.figures.canvas import GREEN, PURPLE, SKY, VERMILLION, Canvas
from nscan_cli.mapping.figures.panels import stack_images
from nscan_cli.matching.joint.joint_energy import JointProblem, all_pairs, joint_energy, no_priors
from nscan_cli.matching.joint.joint_match import match_jointly
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.pairwise import PairOptions, scan_ndt
from nscan_cli.poses import Array
from tests.experiments.charts import ORANGE, heat_map, line_chart
from tests.experiments.report import Report, scan_names

if TYPE_CHECKING:
    from PIL.Image import Image

OPTIONS = PairOptions(cell=0.5)
"""Strokes are smaller than walls."""
SPACING = 0.05
"""m from point to point."""
NOISE, SEED = 0.015, 2
"""Standard deviation of the points, m, along both axes."""
WALLS = (12.0, 7.0, 3.0)
"""Lengths, m. At all shifts that matter the longer one reaches beyond the shorter, so that the wall
prefers none of them."""
HEIGHTS = ((0.75, 2.0), (2.75, 4.0), (4.75, 6.0))
"""m, of the strokes that shapes 1 and 2, 2 and 3, and 1 and 3 have in common."""
STROKES = (
    ((0, -1.0), (0, 0.25), (2, 0.25)),
    ((0, -1.0), (1, -0.75), (1, 0.0)),
    ((1, -0.75), (2, 0.25), (2, -0.75)),
)
"""Of each shape: which height, and where along the wall, m."""
ORIGIN = np.array([-4.0, 3.0])
"""Where every shape is seen from, m: left of all strokes and above the wall, so that every part of a shape
shows the same side in all of them."""
PAIRS = ((0, 1), (1, 2), (0, 2))
SHIFTS = np.linspace(-1.25, 2.5, 151)
"""m, of the curves and the image."""
STARTS = np.linspace(-1.25, 2.5, 16)
"""m, of the matches that look for minima."""
GAP = 1.5
"""m between the shapes in the picture."""
SMALL = 0.75
"""Scale of its text, which makes it as large as that of the charts below."""
APART = 0.1
"""m; minima that are nearer are one."""


@dataclass(frozen=True)
class Minimum:
    """A match in which the Newton steps ended."""

    energy: float
    shifts: Array
    """(n − 1,) of the shapes but the first, along the wall, m."""
    least_eigenvalue: float
    """Those of the Hessian with the first shape fixed."""


def shape(which: int) -> Array:
    """The points (m, 2) of a shape, seen from ORIGIN."""
    half = WALLS[which] / 2
    parts = [_segment((-half, 0.0), (half, 0.0))]
    for height, x in STROKES[which]:
        low, high = HEIGHTS[height]
        parts.append(_segment((x, low), (x, high)))
    points = np.concatenate(parts)
    noise = np.random.Generator(np.random.PCG64([SEED, which])).normal(0.0, NOISE, points.shape)
    seen: Array = points + noise - ORIGIN
    return seen


@functools.cache
def problem(*which: int) -> JointProblem:
    """Some of the shapes, all pairs of them, E itself."""
    points = [shape(each) for each in which]
    ndts = [scan_ndt(part, OPTIONS) for part in points]
    return JointProblem(scan_set(ndts, points), all_pairs(len(which)), no_priors(), 1.0)


@functools.cache
def minima(*which: int) -> tuple[Minimum, ...]:
    """The minima of the energy of some of the shapes, the lowest first: all poses free but the first."""
    found = []
    for shifts in itertools.product(STARTS, repeat=len(which) - 1):
        options = JointOptions(widenings=(1.0,), stride=1, fixed=0)
        match = match_jointly(problem(*which), poses_at(np.array(shifts)), options)
        values = np.linalg.eigvalsh(match.hessian[3:, 3:])
        found.append(Minimum(match.energy, match.poses[1:, 0], float(values[0])))
    kept: list[Minimum] = []
    for each in sorted(found, key=lambda minimum: minimum.energy):
        if all(np.abs(each.shifts - other.shifts).max() > APART for other in kept):
            kept.append(each)
    return tuple(kept)


def poses_at(shifts: Array) -> Array:
    """The poses (n, 3) of n shapes, the first where it was drawn, the others shifted (n − 1,) m."""
    poses = np.zeros((len(shifts) + 1, 3))
    poses[1:, 0] = shifts
    return poses


def pair_energies(first: int, second: int) -> Array:
    """The energy (S,) of two shapes at all SHIFTS of the second."""
    pair = problem(first, second)
    return np.array([joint_energy(pair, poses_at(np.array([shift]))).value for shift in SHIFTS])


def joint_energies() -> Array:
    """The energy (S, S) of all three at all SHIFTS of shape 3 (rows) and of shape 2 (columns)."""
    three = problem(0, 1, 2)
    return np.array([[joint_energy(three, poses_at(np.array([b, c]))).value for b in SHIFTS] for c in SHIFTS])


def report() -> Report:
    """Pictures and table."""
    return Report(
        "Fig. 2: three shapes, any two of which are ambiguous",
        "Each of the three shapes has a wall and three strokes. Any two shapes have strokes of one height "
        "in common, of which one shape has two; so two shifts along the wall match equally well. Only one "
        "combination of these shifts fits all three shapes: where the three lines cross in the image of "
        "the joint energy. The curves show the energies over the shift along the wall, with everything "
        "else as drawn; for all three, it is the lowest energy over all shifts of shape 3. The table has "
        f"the minima from {len(STARTS)} starts for a pair and {len(STARTS) ** 2} for all three, with all "
        "poses free but the first. The Hessian does not show the ambiguity: every minimum is sharp.",
        {"fig_2": _picture()},
        ("matched", "lowest energy", "second lowest", "difference", "least eigenvalue at the lowest"),
        [_row(which) for which in (*PAIRS, (0, 1, 2))],
    )


def _row(which: tuple[int, ...]) -> list[str]:
    lowest, second = minima(*which)[:2]
    share = (second.energy - lowest.energy) / abs(lowest.energy)
    return [
        scan_names(which),
        _told(lowest),
        _told(second),
        f"{second.energy - lowest.energy:.1f} ({share:.1%})",
        f"{lowest.least_eigenvalue:.3g}",
    ]


def _told(minimum: Minimum) -> str:
    shifts = ", ".join(f"{shift + 0.0:.2f}" for shift in np.round(minimum.shifts, 2).tolist())
    return f"{minimum.energy:.1f} at {shifts} m"


def _picture() -> Image:
    """The shapes above the energies of the pairs and of all three."""
    curves: dict[tuple[int, ...], Array] = {pair: pair_energies(*pair) for pair in PAIRS}
    joint = joint_energies()
    curves[0, 1, 2] = joint.min(axis=0)
    chart = line_chart(
        {scan_names(which): (SHIFTS, energies - energies.min()) for which, energies in curves.items()},
        "shift (m)",
        "energy above the lowest",
        "Energies over the shift",
        shape=1.0,
        beside=True,
    )
    lowest, second = (minimum.shifts[None] for minimum in minima(0, 1, 2)[:2])
    image = heat_map(
        # What is above the mean is of no interest: the contrast is for what is below.
        np.minimum(joint, joint.mean()),
        (SHIFTS[0], SHIFTS[0], SHIFTS[-1], SHIFTS[-1]),
        "shift of shape 2 (m)",
        "shift of shape 3 (m)",
        "Energy of all three (dark: low)",
        {"lowest": (GREEN, lowest), "second lowest": (VERMILLION, second)},
    )
    energies = stack_images([chart, image], True)
    return stack_images([_shapes(energies.width), energies])


def _shapes(width: int) -> Image:
    """The three beside each other, in a picture of this width, pixels."""
    lefts = np.concatenate([[0.0], np.cumsum(np.array(WALLS) + GAP)])
    bounds = (-GAP / 2, -0.5, float(lefts[-1]) - GAP / 2, HEIGHTS[-1][1] + 0.5)
    margins = SMALL * (TITLE_MARGINS[0] + TITLE_MARGINS[2]) / 1000
    canvas = Canvas.blank(bounds, int(width / (1 + margins)), TITLE_MARGINS, SMALL)
    entries: list[LegendEntry] = []
    for which, colour in enumerate((ORANGE, SKY, PURPLE)):
        moved = shape(which) + ORIGIN + np.array([lefts[which] + WALLS[which] / 2, 0.0])
        canvas.dots(moved, 3.2, colour)
        entries.append(("disc", colour, f"shape {which + 1}"))
    draw_title_and_legend(canvas, "Three shapes", entries)
    return canvas.image()


def _segment(start: tuple[float, float], end: tuple[float, float]) -> Array:
    count = round(float(np.hypot(end[0] - start[0], end[1] - start[1])) / SPACING) + 1
    return np.linspace(start, end, count)
