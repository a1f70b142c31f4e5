"""Steps from scan to scan all over a log, measured by the scans alone: the evidence about its file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.options import StepOptions
from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.pairwise import PairMatch, match_pair, matched_points, scan_ndt, settle_pair
from nscan_cli.poses import Array, Indices, relative


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
    """(n, 3, 3) of these poses."""

    def __len__(self) -> int:
        return len(self.first)

    def odometry(self, poses: Array) -> Array:
        """(n, 3) the same steps of the robot by odometry, of which `poses` (S, 3) are those of all scans."""
        return relative(poses[self.last], poses[self.first])


def measure_steps(
    log: LaserLog,
    rows: tuple[Indices, Indices],
    options: StepOptions,
    corrected: Callable[[int], Array | None] | None = None,
) -> MeasuredSteps:
    """Of the steps from the first rows (n,) to the last (n,), those that the scans measure beyond doubt.

    Every step is matched without odometry, so that the result is independent of it. `corrected` gives the
    points (m, 2) of a row in the laser's frame if the laser turns; None: as if it saw all beams at once.
    """
    at_laser = replace(log, mount=np.zeros(3), path=None)
    found: list[tuple[int, int, PairMatch]] = []
    first, last = rows
    for begin, end in zip(first.tolist(), last.tolist(), strict=True):
        before, after = (
            _thinned_points(at_laser, row, options) if corrected is None else corrected(row)
            for row in (begin, end)
        )
        match = _measured(before, after, options)
        if match is not None:
            found.append((begin, end, match))
    ends = np.array([(begin, end) for begin, end, _ in found], dtype=np.int64).reshape(-1, 2)
    return MeasuredSteps(
        ends[:, 0],
        ends[:, 1],
        np.array([match.pose for *_, match in found]).reshape(-1, 3),
        np.array([match.covariance for *_, match in found]).reshape(-1, 3, 3),
    )


def _measured(reference: Array | None, points: Array | None, options: StepOptions) -> PairMatch | None:
    """The pose of a scan's points (m, 2) in the frame of the reference (n, 2); None where it is in doubt."""
    if reference is None or points is None:
        return None
    gaussians = scan_ndt(reference, options.pair)
    match = match_pair(gaussians, points, np.zeros(3), None, options.pair)
    if not match.converged or match.covariance is None or match.overlap < options.min_overlap:
        return None
    aside = options.probe * np.array([np.cos(match.weakest.direction), np.sin(match.weakest.direction), 0.0])
    again = settle_pair(gaussians, points, match.pose + aside, options.pair)
    apart = np.abs(relative(again.pose, match.pose)).max()
    return match if apart <= options.agreement else None


def _thinned_points(log: LaserLog, row: int, options: StepOptions) -> Array | None:
    """The points (m, 2) of a scan, of so many beams as are matched; None for too few."""
    try:
        points = matched_points(log, row, options.pair)
    except InputDataError:
        return None
    return points[:: max(log.ranges.shape[1] // options.max_beams, 1)].copy()
