"""Fig. 5: six scans that close a loop: three from where it begins, three from where it ends."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.motion_model import MotionModel, odometry_prior
from nscan_cli.matching.pairwise import match_pair, matched_points, scan_ndt
from nscan_cli.poses import Array, compose
from tests.experiments.cases import HEADER, Case, Outcome, office_case, paper_row, real_case, run
from tests.experiments.reference_logs import ReferenceLog, reference_log
from tests.experiments.report import Report
from tests.matching.problems import OPTIONS

OFFICE_ROWS = np.array([1370, 1384, 1398, 2376, 2390, 2404])
"""Of the drive: the north corridor, and there again after 90 m round the loop."""
INTEL_KEYFRAME = 3
"""Every third of the scans with reference poses is a keyframe: 1.05 m apart."""
INTEL_KEYFRAMES = np.array([57, 59, 61, 135, 137, 139])
"""Keyframes from both ends of the first round."""


@functools.cache
def outcomes() -> tuple[Outcome, ...]:
    """The simulated office, and intel where it is there."""
    return run([office_case(OFFICE_ROWS), intel_case()])


def intel_case() -> Case | None:
    """Six scans of intel, from pairwise matches chained round the loop; None where the log is not there."""
    intel = reference_log("intel")
    if intel is None:
        return None
    chain = np.arange(0, INTEL_KEYFRAME * INTEL_KEYFRAMES[-1] + 1, INTEL_KEYFRAME)
    start = chained(intel, intel.rows[chain])[INTEL_KEYFRAMES]
    return real_case(intel, chain[INTEL_KEYFRAMES], start)


def chained(reference: ReferenceLog, rows: NDArray[np.int64]) -> Array:
    """The poses (n, 3) of scans, each matched with the one before it, as step 2 of the paper's SLAM (V)."""
    log, model = reference.log, MotionModel()
    assert log.odometry is not None
    points = [matched_points(log, row, OPTIONS) for row in rows.tolist()]
    poses = [np.zeros(3)]
    for at in range(1, len(rows)):
        prior = odometry_prior(log.odometry[rows[at - 1]], log.odometry[rows[at]], model)
        reference_ndt = scan_ndt(points[at - 1], OPTIONS)
        poses.append(
            compose(poses[-1], match_pair(reference_ndt, points[at], prior.mean, prior, OPTIONS).pose)
        )
    return np.array(poses)


def report() -> Report:
    """Pictures and table."""
    done = outcomes()
    names = ("fig_5_office", "fig_5_intel")
    return Report(
        "Fig. 5: six scans closing a loop",
        "Three scans are from where a loop begins, three from where it ends. The start has the drift of a "
        "whole round: in the office that of the odometry, on intel that of scans 1 m apart, each matched "
        "in a pair with the one before. They are matched at once, as for Fig. 4.",
        {name: outcome.picture() for name, outcome in zip(names, done, strict=False)},
        HEADER,
        [*(outcome.row() for outcome in done), paper_row(6, 30, 174)],
        () if len(done) == len(names) else ("Left out: intel, since its log is not there.",),
    )
