"""Scans that are matched jointly from a given start, with the poses that they should end in."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.mapping.figures.match_plots import plot_nscan
from nscan_cli.matching.joint.index_set import IndexSetKind
from nscan_cli.matching.joint.joint_energy import JointProblem, all_pairs, no_priors
from nscan_cli.matching.joint.joint_match import JointMatch, match_near_and_far
from nscan_cli.matching.joint.nscan_match import NScanMatch, nscan_match
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.outliers import ExcludedScan
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.pairwise import matched_points, scan_ndt
from nscan_cli.poses import Array, compose, relative, wrap
from tests.experiments.reference_logs import ReferenceLog
from tests.matching.problems import OPTIONS, errors, near, office_truth
from tests.simulation.drive import odometry
from tests.simulation.scenes import office

if TYPE_CHECKING:
    from PIL.Image import Image

HEADER = (
    "scans",
    "n",
    "pairs",
    "error at the start",
    "error at the end",
    "outcome",
    "iterations",
    "evaluations",
    "first scan fixed: iterations, evaluations",
    "iterations from a good start",
)
SEED = 2
"""Of the simulated office's odometry and range noise."""
GOOD, GOOD_ANGLE, GOOD_SEED = 0.03, 0.01, 1
"""Greatest errors (m, rad) of the poses of a good start, and the seed of their draws."""
SUCCESS = 0.1
"""Greatest error (m) of a scan after a match that succeeds."""


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

    def matched(self, fixed: int | None = None, pairs: IndexSetKind = "overlap") -> Matched:
        """Matched as `nscan --prior none` does, the gauge free or a scan fixed.

        Raises RuntimeError when no two of the scans match.
        """
        match, left_out = nscan_match(
            self.points,
            self.start,
            lambda _kept: no_priors(),
            fixed or 0,
            OPTIONS,
            JointOptions(fixed=fixed),
            pairs,
        )
        if match is None:
            raise RuntimeError(f"{self.name}: no two of the scans match")
        return Matched(match, tuple(left_out), errors(match.poses, self.truth[list(match.kept)]))

    def from_good_start(self, fixed: int | None = None) -> JointMatch:
        """Matched as nscan does, with all pairs, from near the truth."""
        count = len(self.points)
        scans = scan_set([scan_ndt(points, OPTIONS) for points in self.points], self.points)
        problem = JointProblem(scans, all_pairs(count), no_priors(), 2 * OPTIONS.scale / count)
        start = near(self.truth, GOOD_SEED, GOOD, GOOD_ANGLE)
        return match_near_and_far(problem, start, JointOptions(fixed=fixed))


@dataclass(frozen=True)
class Matched:
    """Scans after their match."""

    match: NScanMatch
    left_out: tuple[ExcludedScan, ...]
    errors: Array
    """(k, 3) of the scans that were kept, seen from the first of them, m and rad."""

    def succeeded(self) -> bool:
        """Whether every scan is where it was taken."""
        return not self.left_out and farthest(self.errors) < SUCCESS


@dataclass(frozen=True)
class Outcome:
    """A case and its matches."""

    case: Case
    before: Array
    """(n, 3) errors of the start, as those of Matched."""
    free: Matched
    fixed: Matched
    """With the first scan fixed."""
    from_good: JointMatch

    def picture(self) -> Image:
        """The scans before and after."""
        case = self.case
        return plot_nscan(case.numbers, case.points, case.start, self.free.match, self.free.left_out)

    def row(self) -> list[str]:
        """What the table says of it."""
        match, fixed = self.free.match, self.fixed.match.joint
        outcome = "converged" if match.reason is None else match.reason
        if self.free.left_out:
            outcome += f", {len(self.free.left_out)} left out"
        return [
            self.case.name,
            str(len(self.case.numbers)),
            str(len(match.joint.pairs)),
            _told(self.before),
            _told(self.free.errors),
            outcome,
            told_iterations(match.joint.iterations, match.joint.last_iterations),
            str(match.joint.evaluations),
            f"{told_iterations(fixed.iterations, fixed.last_iterations)}, {fixed.evaluations}",
            told_iterations(self.from_good.iterations, self.from_good.last_iterations),
        ]


def office_case(rows: NDArray[np.int64]) -> Case:
    """Scans of the simulated office from poses in some rows of the drive, from its odometry.

    The start is laid over the truth, so that walls are parallel to the axes in a picture.
    """
    truth, driven = office_truth()[rows], _office_odometry()[rows]
    log = office().record_at(truth, SEED).log()
    turn = float(np.mean(wrap(truth[:, 2] - driven[:, 2])))
    start = compose(np.array([0.0, 0.0, turn]), driven)
    start[:, :2] += np.mean(truth[:, :2] - start[:, :2], axis=0)
    points = tuple(matched_points(log, row, OPTIONS) for row in range(len(log)))
    return Case("simulated office", tuple(rows.tolist()), points, start, truth)


@functools.cache
def _office_odometry() -> Array:
    """(S, 3) of the whole drive."""
    return odometry(office_truth(), office().errors, np.random.Generator(np.random.PCG64(SEED)))


def real_case(reference: ReferenceLog, chosen: NDArray[np.int64], start: Array | None = None) -> Case:
    """Some of the scans that have reference poses, seen from the first of their starts (n, 3).

    They start where the log's odometry says when no other start is given.
    """
    log, rows = reference.log, reference.rows[chosen]
    if start is None:
        assert log.odometry is not None
        start = log.odometry[rows]
    points = tuple(matched_points(log, row, OPTIONS) for row in rows.tolist())
    numbers = tuple(log.numbers[rows].tolist())
    name = log.source.name.split(".")[0]
    return Case(name, numbers, points, relative(start, start[0]), reference.poses[chosen])


def run(cases: Sequence[Case | None]) -> tuple[Outcome, ...]:
    """Match those that are there."""
    return tuple(
        Outcome(case, errors(case.start, case.truth), case.matched(), case.matched(0), case.from_good_start())
        for case in cases
        if case is not None
    )


def paper_row(scans: int, iterations: int, evaluations: int) -> list[str]:
    """What the paper reports of its own scans."""
    pairs = scans * (scans - 1)
    counts = [str(iterations), str(evaluations)]
    return ["the paper's", str(scans), str(pairs), "", "", "converged", *counts, "", "5 to 10"]


def farthest(off: Array) -> float:
    """The greatest distance (m) of errors (n, 3)."""
    return float(np.hypot(off[:, 0], off[:, 1]).max())


def told_iterations(iterations: float, last: float) -> str:
    """How many, and how many of them in the last stage."""
    return f"{iterations:g} ({last:g})"


def _told(off: Array) -> str:
    return f"{farthest(off):.3f} m, {np.degrees(np.abs(off[:, 2]).max()):.1f}°"
