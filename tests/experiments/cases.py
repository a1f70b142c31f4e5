"""Scans that are matched jointly from a given start, with the poses that they should end in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.cli.knowledge import no_knowledge
from nscan_cli.mapping.plots import plot_nscan
from nscan_cli.matching.joint import JointMatch, JointOptions, match_jointly
from nscan_cli.matching.joint_energy import JointProblem, all_pairs, lay_out, no_priors
from nscan_cli.matching.nscan import LeftOut, NScanMatch, nscan_match
from nscan_cli.matching.pairwise import matched_points, scan_ndt
from nscan_cli.poses import Array, compose, relative, wrap
from tests.experiments.reference import ReferenceLog
from tests.matching.problems import OPTIONS, errors, near
from tests.simulation.scenes import Scene

if TYPE_CHECKING:
    from PIL.Image import Image

HEADER = (
    "scans",
    "n",
    "error at the start",
    "error at the end",
    "outcome",
    "iterations",
    "evaluations",
    "iterations from a good start",
)
GOOD, GOOD_ANGLE, GOOD_SEED = 0.03, 0.01, 1
"""How far off (m, rad) the poses of a good start are at most, and how they are drawn."""


@dataclass(frozen=True)
class Case:
    """n scans."""

    name: str
    numbers: tuple[int, ...]
    """As the log counts them."""
    points: tuple[Array, ...]
    start: Array
    """(n, 3)"""
    truth: Array
    """(n, 3), in any frame."""


@dataclass(frozen=True)
class Outcome:
    """A case after the match."""

    case: Case
    match: NScanMatch
    left_out: tuple[LeftOut, ...]
    before: Array
    """(n, 3) errors of the start, seen from the first scan, m and rad."""
    after: Array
    """(k, 3) the same of the scans that were kept, at the end."""
    from_good: JointMatch
    """The last stage alone, from a good start."""

    def picture(self) -> Image:
        """The scans before and after."""
        case = self.case
        return plot_nscan(case.numbers, case.points, case.start, self.match, self.left_out)

    def row(self) -> list[str]:
        """What the table says of it."""
        joint = self.match.joint
        outcome = "converged" if self.match.reason is None else self.match.reason
        if self.left_out:
            outcome += f", {len(self.left_out)} left out"
        return [
            self.case.name,
            str(len(self.case.numbers)),
            _worst(self.before),
            _worst(self.after),
            outcome,
            str(joint.iterations),
            str(joint.evaluations),
            str(self.from_good.iterations),
        ]


def simulated_case(scene: Scene, rows: NDArray[np.int64], driven: Array, seed: int) -> Case:
    """Scans from poses in some rows of a scene's drive; `driven` (n, 3) are those of the odometry.

    The start is laid over the truth, so that walls are parallel to the axes in a picture.
    """
    truth = scene.truth()[rows]
    log = scene.record_at(truth, seed).log()
    turn = float(np.mean(wrap(truth[:, 2] - driven[:, 2])))
    start = compose(np.array([0.0, 0.0, turn]), driven)
    start[:, :2] += np.mean(truth[:, :2] - start[:, :2], axis=0)
    points = tuple(matched_points(log, row, OPTIONS) for row in range(len(log)))
    return Case(f"simulated {scene.name}", tuple(rows.tolist()), points, start, truth)


def real_case(reference: ReferenceLog, chosen: NDArray[np.int64], start: Array) -> Case:
    """Some of the scans that have reference poses, seen from the first of their starts (n, 3)."""
    log, rows = reference.log, reference.rows[chosen]
    points = tuple(matched_points(log, row, OPTIONS) for row in rows.tolist())
    numbers = tuple(log.numbers[rows].tolist())
    name = log.source.name.split(".")[0]
    return Case(name, numbers, points, relative(start, start[0]), reference.poses[chosen])


def run(case: Case) -> Outcome:
    """Match as `nscan --prior none` does: all pairs, the gauge free."""
    match, left_out = nscan_match(case.points, case.start, no_knowledge, 0, OPTIONS, JointOptions())
    if match is None:
        raise RuntimeError(f"{case.name}: no two of the scans match")
    return Outcome(
        case,
        match,
        tuple(left_out),
        errors(case.start, case.truth),
        errors(match.joint.poses, case.truth[list(match.kept)]),
        _from_good_start(case),
    )


def _from_good_start(case: Case) -> JointMatch:
    count = len(case.points)
    scans = lay_out([scan_ndt(points, OPTIONS) for points in case.points], case.points)
    problem = JointProblem(scans, all_pairs(count), no_priors(), 2 * OPTIONS.scale / count)
    start = near(case.truth, GOOD_SEED, GOOD, GOOD_ANGLE)
    return match_jointly(problem, start, JointOptions(widenings=(1.0,), neutral=True))


def paper_row(scans: int, iterations: int, evaluations: int) -> list[str]:
    """What the paper reports of its own scans."""
    return ["the paper's", str(scans), "", "", "converged", str(iterations), str(evaluations), "5 to 10"]


def _worst(off: Array) -> str:
    metres, degrees = np.hypot(off[:, 0], off[:, 1]).max(), np.degrees(np.abs(off[:, 2]).max())
    return f"{metres:.3f} m, {degrees:.1f}°"
