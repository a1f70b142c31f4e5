"""Fig. 3: a robot enters a room (1), turns there (2), and leaves (3).

Scans 1 and 2 leave the way along the corridor open, scans 1 and 3 the way across it. All three together
leave nothing open but the gauge.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.mapping.figures.axes import LegendEntry, draw_title_and_legend
from nscan_cli.mapping.figures.canvas import BLUE, GREEN, PURPLE, VERMILLION
from nscan_cli.mapping.figures.panels import bounds_around, panel, stack_images
from nscan_cli.mapping.figures.symbols import draw_robots
from nscan_cli.matching.joint.joint_energy import JointProblem, Priors, joint_energy
from nscan_cli.matching.joint.joint_match import JointMatch, match_near_and_far
from nscan_cli.matching.joint.neutral_energy import neutral_energy
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.uncertainty import Weakest, weakest_translation
from nscan_cli.poses import Array, compose, relative, transform
from tests.experiments.charts import line_chart
from tests.experiments.report import Report, scan_names
from tests.matching.problems import OPTIONS, Problem, errors, fig_3, near

if TYPE_CHECKING:
    from PIL.Image import Image

COLOURS = (BLUE, VERMILLION, GREEN)
"""Of the scans."""
MINIMUM = 1e-3
"""Gradient norm of a minimum. Many joint matches are held at a cell's border instead, where the energy jumps
and its gradient is not zero: there the turn of all scans has some curvature too."""
DRAWS = 20
"""Seeds of the matches that give the usual errors."""
OFF, OFF_ANGLE = 0.1, 0.05
"""Greatest errors (m, rad) of the poses that the matches start from."""
PAIRS = ((0, 1), (0, 2), (1, 2))
ALL = (0, 1, 2)
ENLARGED = 30.0
"""Standard deviations of the ellipses, ten times the usual number, so that they are visible."""
SHIFTS = np.linspace(-0.5, 0.5, 81)
"""m, of the curves."""
SINGULAR = 1e-10
"""An eigenvalue below this share of the greatest is 0 but for rounding."""
PINNED = 1e9
"""Information (1/m²) of a prior that holds a scan at a shift."""


@dataclass(frozen=True)
class Subset:
    """What some of the scans know of each other."""

    scans: tuple[int, ...]
    eigenvalues: Array
    """(3n − 3,) those of the Hessian with the first scan fixed, at the joint minimum of all three."""
    weakest: tuple[Weakest, ...]
    """Of each scan's position but the first's."""
    error: float
    """Greatest error (m) of a scan in their own match."""
    usual_error: float
    """m; its median over all DRAWS."""


@functools.cache
def usual_seed() -> int:
    """Of the noise and of the starts: the first whose joint match ends in a minimum."""
    return next(seed for seed in range(DRAWS) if matched((0, 1, 2), seed).gradient_norm < MINIMUM)


@functools.cache
def scans(seed: int | None = None) -> Problem:
    """The three scans, with noise; of the usual seed if none is given, as in all that follows."""
    return fig_3(noise=True, seed=usual_seed() if seed is None else seed)


def energy_of(which: Sequence[int], priors: Priors | None = None, seed: int | None = None) -> JointProblem:
    """The energy of some of the scans, all pairs, as `nscan` weighs it."""
    return scans(seed).joint(*which, priors=priors, scale=2 * OPTIONS.scale / len(which))


def matched(which: Sequence[int], seed: int | None = None) -> JointMatch:
    """Some of the scans matched by themselves."""
    start = near(scans(seed).truth, usual_seed() if seed is None else seed, OFF, OFF_ANGLE)[list(which)]
    return match_near_and_far(energy_of(which, seed=seed), start, JointOptions(fixed=0))


def error(which: Sequence[int], seed: int | None = None) -> float:
    """The greatest error (m) of a scan in their own match."""
    off = errors(matched(which, seed).poses, scans(seed).truth[list(which)])
    return float(np.hypot(off[:, 0], off[:, 1]).max())


@functools.cache
def joint() -> JointMatch:
    """The joint match of all three."""
    return matched(ALL)


def information(which: Sequence[int]) -> Array:
    """The Hessian (3n − 3, 3n − 3) of some of the scans at the joint minimum, the first of them held.

    In the frame of the first.
    """
    poses = joint().poses[list(which)]
    return joint_energy(energy_of(which), relative(poses, poses[0])).hessian[3:, 3:]


def subset(which: tuple[int, ...]) -> Subset:
    """What they know."""
    hessian = information(which)
    return Subset(
        which,
        np.linalg.eigvalsh(hessian).astype(np.float64),
        tuple(
            weakest_translation(_marginal(hessian, at), OPTIONS.weak_sigma) for at in range(len(which) - 1)
        ),
        error(which),
        float(np.median([error(which, seed) for seed in range(DRAWS)])),
    )


def free_eigenvalues() -> Array:
    """(9,) of the Hessian of all three with the gauge free."""
    hessian = joint_energy(energy_of(ALL), joint().poses).hessian
    return np.linalg.eigvalsh(hessian).astype(np.float64)


def profile(which: tuple[int, ...], moved: int, axis: int) -> Array:
    """The lowest energy (S,) with a scan held at SHIFTS from its joint pose along an axis of scan 1's frame.

    All other parameters are free. A very sure prior (14) on the one parameter holds the scan. The energy
    is the neutral one, since the other prefers shifts at which more of the walls overlaps.
    """
    poses = joint().poses[list(which)]
    place = which.index(moved)
    pose = relative(poses[place], poses[0])
    hold = np.zeros((1, 3, 3))
    hold[0, axis, axis] = PINNED
    options = JointOptions(widenings=(1.0,), fixed=0)
    energies = np.empty(len(SHIFTS))
    middle = len(SHIFTS) // 2
    # From the joint pose outwards, each match from the end of the one before.
    for outwards in (range(middle, len(SHIFTS)), range(middle, -1, -1)):
        here = poses
        for at in outwards:
            mean = pose.copy()
            mean[axis] += SHIFTS[at]
            held = energy_of(which, Priors(np.array([[0, place]]), mean[None], hold))
            here = match_near_and_far(held, here, options).poses
            energies[at] = neutral_energy(energy_of(which), here, options.overlap_reward)
    return energies


def report() -> Report:
    """Picture and table."""
    free = _told(free_eigenvalues())
    return Report(
        "Fig. 3: a robot enters a room (1), turns there (2), and leaves (3)",
        "Scans 1 and 2 share only the walls of the corridor, scans 1 and 3 only the far wall of the room. "
        "Either pair leaves one direction open; the little information there comes from the cells of the "
        "NDT. Scans 2 and 3 both see the corner beside the door, and all three together leave nothing "
        "open. The eigenvalues (1/m² and 1/rad², mixed) are those of the Hessian at the joint minimum, "
        "with the first scan held. The standard deviations are those along the weakest direction of each "
        "position, with its angle in the frame of the first scan. The error is that of a match of these "
        f"scans alone, from poses up to {OFF} m and {OFF_ANGLE} rad off; in brackets is the median over "
        f"{DRAWS} draws of noise and start. The curves show the lowest energy with a scan held at a shift "
        "from its joint pose: scan 2 along the corridor, scan 3 across it.",
        {"fig_3": _picture()},
        ("scans", "eigenvalues", "greatest σ of the others' positions", "error of their own match"),
        [*(_row(subset(which)) for which in (*PAIRS, ALL)), ["1, 2 and 3, gauge free", free, "", ""]],
    )


def _row(of: Subset) -> list[str]:
    known = [
        f"{scan + 1}: " + ("open" if weak.sigma is None else f"{weak.sigma:.3f} m")
        + f" along {np.degrees(weak.direction):.0f}°"
        for scan, weak in zip(of.scans[1:], of.weakest, strict=True)
    ]  # fmt: skip
    return [
        scan_names(of.scans),
        _told(of.eigenvalues),
        "; ".join(known),
        f"{of.error:.3f} m ({of.usual_error:.3f} m)",
    ]


def _told(eigenvalues: Array) -> str:
    zero = SINGULAR * eigenvalues[-1]
    return ", ".join("0" if abs(value) < zero else f"{value:.3g}" for value in eigenvalues.tolist())


def _marginal(hessian: Array, which: int) -> Array:
    """The marginal information (3, 3) on one of the poses."""
    at = slice(3 * which, 3 * which + 3)
    return np.linalg.inv(np.linalg.inv(hessian)[at, at]).astype(np.float64)


def _picture() -> Image:
    """The scans with the information of each subset, and the energies where the pairs leave them open."""
    chart = line_chart(
        {
            f"{scan_names(which)}, {way}": (SHIFTS, energies - energies.min())
            for moved, axis, way in ((1, 0, "along"), (2, 1, "across"))
            for which in ((0, moved), ALL)
            for energies in (profile(which, moved, axis),)
        },
        "shift (m)",
        "energy above the lowest",
        "Energies, scan 2 shifted along, scan 3 across",
        beside=True,
    )
    above, below = [_panel((0, 1)), _panel((0, 2))], [_panel(ALL), chart]
    return stack_images([stack_images(above, True), stack_images(below, True)])


def _panel(which: tuple[int, ...]) -> Image:
    """Some of the scans at their joint poses, and the uncertainty of all but the first."""
    poses = compose(scans().truth[0], relative(joint().poses, joint().poses[0]))
    placed = [transform(pose, points) for pose, points in zip(poses, scans().points, strict=True)]
    canvas = panel(bounds_around(np.concatenate(placed)), beside=True)
    covariance = np.linalg.inv(information(which)).astype(np.float64)
    entries: list[LegendEntry] = []
    for scan in which:
        canvas.dots(placed[scan], 3.0, COLOURS[scan])
        entries.append(("robot", COLOURS[scan], f"scan {scan + 1}"))
    for at, scan in enumerate(which[1:]):
        block = covariance[3 * at : 3 * at + 2, 3 * at : 3 * at + 2]
        canvas.ellipses(poses[None, scan, :2], block[None], ENLARGED, PURPLE)
    for scan in which:
        pose = poses[scan]
        draw_robots(canvas, canvas.pixels(pose[None, :2]), pose[None, 2], 7.0, COLOURS[scan])
    entries.append(("ellipse", PURPLE, f"{ENLARGED:g} sigma"))
    draw_title_and_legend(canvas, f"Scans {scan_names(which)}", entries)
    return canvas.image()
