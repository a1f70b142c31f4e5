"""Steps from scan to scan all over a log, measured by the scans alone: the evidence about its file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.thinned_scans import thinned_scan
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.correlative_search import search
from nscan_cli.matching.likelihood_field import likelihood_field
from nscan_cli.matching.scan_pairs import ScanPair, match_scans
from nscan_cli.matching.uncertainty import covariances_of, why_no_minimum
from nscan_cli.poses import Array, Indices, Mask, relative, transform, wrap

KnownSteps = dict[tuple[int, int], tuple[Array, Array] | None]
"""The pose (3,) and its covariance (3, 3) of steps from a row to another; None of those in doubt."""
UNTOLD = 1e3
"""Standard deviation of a place that a step does not tell, m."""


@dataclass(frozen=True)
class MeasuredSteps:
    """n steps, each from one scan of a log to a later one."""

    first: Indices
    """(n,) row where the step begins."""
    last: Indices
    """(n,) row where it ends."""
    laser: Array
    """(n, 3) pose of the laser at the end, in the laser's frame at the beginning, m and rad."""
    covariances: Array
    """(n, 3, 3) covariances of these poses."""

    def __len__(self) -> int:
        return len(self.first)

    def odometry(self, poses: Array) -> Array:
        """(n, 3) these steps of the robot by odometry, from the `poses` (S, 3) of all scans."""
        return relative(poses[self.last], poses[self.first])

    def of(self, steps: Indices | Mask) -> MeasuredSteps:
        """Some of these steps."""
        return MeasuredSteps(*(column[steps] for column in vars(self).values()))

    def tell_places(self, options: StepOptions) -> Mask:
        """(n,) which steps tell how far the laser came; the others tell its turn alone."""
        told: Mask = np.linalg.eigvalsh(self.covariances[:, :2, :2])[:, -1] <= options.max_sigma**2
        return told

    def with_others(self, others: MeasuredSteps) -> MeasuredSteps:
        """These and other steps, in order of their first rows."""
        columns = zip(vars(self).values(), vars(others).values(), strict=True)
        together = MeasuredSteps(*map(np.concatenate, columns))
        return together.of(np.argsort(together.first, kind="stable"))

    def chains(self, longest: int) -> Indices:
        """The first steps (c,) of chains of up to `longest` steps, each of which begins where the one before
        ends.

        Added up over a chain, errors of the stamps matter less. If stamps are now too late and now too early,
        the turn of a short step is compared with odometry of another time. The two then agree less, and the
        fitted ratio comes out too small.
        """
        follows = np.append(False, self.first[1:] == self.last[:-1])
        begins: list[int] = []
        for at, is_next in enumerate(follows.tolist()):
            if not begins or not is_next or at - begins[-1] >= longest:
                begins.append(at)
        return np.array(begins, dtype=np.int64)


def measure_steps(
    log: LaserLog,
    rows: tuple[Indices, Indices],
    options: StepOptions,
    corrected: Callable[[int], Array | None] | None = None,
    known: KnownSteps | None = None,
    turns_alone: bool = False,
) -> MeasuredSteps:
    """Measure the steps from the first rows (n,) to the last (n,); those in doubt are left out.

    So are those that tell a turn alone, unless `turns_alone` are wanted, too.

    Every step is matched without odometry, so that the result is independent of it. `corrected` gives the
    points (m, 2) of a row in the laser's frame if the laser turns; None: as if it saw all beams at once.
    Those in `known` are taken from there, and others are added to it.
    """

    def as_at_once(row: int) -> Array | None:
        scan = thinned_scan(log, row, options)
        return None if scan is None else scan.points

    known = {} if known is None else known
    view = _narrow_view(log, options)
    pairs = list(zip(rows[0].tolist(), rows[1].tolist(), strict=True))
    new = [pair for pair in dict.fromkeys(pairs) if pair not in known]
    points = corrected or as_at_once
    matches = [_matched(points(begin), points(end), options, view) for begin, end in new]
    known.update(zip(new, _with_covariances(matches, options), strict=True))
    found = [(pair, step) for pair in pairs if (step := known[pair]) is not None]
    ends = np.array([pair for pair, _ in found], dtype=np.int64).reshape(-1, 2)
    steps = MeasuredSteps(
        ends[:, 0],
        ends[:, 1],
        np.array([pose for _, (pose, _) in found]).reshape(-1, 3),
        np.array([covariance for _, (_, covariance) in found]).reshape(-1, 3, 3),
    )
    return steps if turns_alone else steps.of(steps.tell_places(options))


def _narrow_view(log: LaserLog, options: StepOptions) -> tuple[float, float] | None:
    """First and last direction (rad) of what the laser of a log sees; None for a wide view."""
    first, last, _ = field_of_view(log)
    return (min(first, last), max(first, last)) if abs(last - first) < options.narrow_view else None


def _matched(
    reference: Array | None, points: Array | None, options: StepOptions, view: tuple[float, float] | None
) -> ScanPair | None:
    """The match of a scan's points (m, 2) with the reference (n, 2); None where it is in doubt."""
    if reference is None or points is None:
        return None
    pair, probe, least = options.pair, options.probe, options.min_overlap
    match = match_scans(reference, points, np.zeros(3), pair, probe)
    if match.overlap < least:
        # Outdoors, with few returns or at speed, the robot may have come too far for a match to find it.
        field = likelihood_field(reference, options.search)
        found = search(field, points, np.zeros(3), 0.0, options.search)
        if found is None:
            return None
        match, least = match_scans(reference, points, found.pose, pair, probe), options.min_searched_overlap
    if not match.converged or match.overlap < least:
        return None
    if view is None:
        return match if match.apart <= options.agreement else None
    # Walls end in the reference where its view does: points beyond would be drawn back to there.
    seen = points[_in_view(transform(match.pose, points), view, options)]
    if len(seen) < least * len(points):
        return None
    again = match_scans(reference, seen, match.pose, pair, probe, is_near=True)
    is_same_turn = abs(wrap(again.pose[2] - match.pose[2])) <= options.agreement
    return again if again.converged and is_same_turn else None


def _in_view(points: Array, view: tuple[float, float], options: StepOptions) -> Mask:
    """(m,) which of points (m, 2) lie between two directions (rad), and not at the border."""
    right, left = view
    from_right = points[:, 1] * np.cos(right) - points[:, 0] * np.sin(right)
    from_left = points[:, 0] * np.sin(left) - points[:, 1] * np.cos(left)
    inside: Mask = np.minimum(from_right, from_left) >= options.view_margin
    return inside


def _with_covariances(
    matches: list[ScanPair | None], options: StepOptions
) -> list[tuple[Array, Array] | None]:
    """The pose of each match and its covariance; None where it is in doubt."""
    known = [match for match in matches if match is not None]
    covariances = iter(covariances_of(np.array([match.information for match in known]).reshape(-1, 3, 3)))
    return [None if match is None else _step(match, next(covariances), options) for match in matches]


def _step(match: ScanPair, covariance: Array | None, options: StepOptions) -> tuple[Array, Array] | None:
    """The pose of a match and its covariance (3, 3); None where it is in doubt."""
    if covariance is None or why_no_minimum(match.gradient, covariance, options.pair.convergence) is not None:
        return None
    if match.apart > options.agreement:
        covariance = covariance + np.diag([UNTOLD, UNTOLD, 0.0]) ** 2
    return (match.pose, covariance) if covariance[2, 2] <= options.max_turn_sigma**2 else None
