"""Fig. 4: ten scans, matched jointly from where the odometry says they were taken."""

from __future__ import annotations

import functools

import numpy as np

from tests.experiments.cases import (
    GOOD,
    GOOD_ANGLE,
    HEADER,
    Case,
    Outcome,
    office_case,
    paper_row,
    real_case,
    run,
)
from tests.experiments.reference_logs import reference_log
from tests.experiments.report import Report

OFFICE_ROWS = np.arange(320, 620, 30)
"""Of the drive: into a room and out again, along the corridor and into the room across; 2.5 m apart."""
INTEL_CHOSEN = np.arange(1320, 1340, 2)
"""Of the scans with reference poses, which are 0.35 m apart: along a corridor to its end."""


@functools.cache
def outcomes() -> tuple[Outcome, ...]:
    """The simulated office, and intel where it is there."""
    return run([office_case(OFFICE_ROWS), intel_case()])


def intel_case() -> Case | None:
    """Ten scans of intel; None where the log is not there."""
    intel = reference_log("intel")
    return None if intel is None else real_case(intel, INTEL_CHOSEN)


def report() -> Report:
    """Pictures and table."""
    done = outcomes()
    names = ("fig_4_office", "fig_4_intel")
    return Report(
        "Fig. 4: ten scans from odometry",
        "Ten scans start where the odometry has them, and are matched at once, without a prior and with a "
        "free gauge. The errors are the largest of all scans, relative to the first: against the simulated "
        "truth or, on intel, against poses by least squares from the reference relations of Kümmerle et "
        "al. 2009. Iterations and evaluations count all stages of both attempts that `nscan` makes from a "
        "start; in brackets are the iterations of the last stage. An evaluation is one of the joint energy "
        f"with gradient and Hessian. The good start is drawn up to {GOOD} m and {GOOD_ANGLE} rad off the "
        "truth, and matched in the same way. These examples succeed; the section on the two gauges tells "
        "how many do.",
        {name: outcome.picture() for name, outcome in zip(names, done, strict=False)},
        HEADER,
        [*(outcome.row() for outcome in done), paper_row(10, 30, 267)],
        () if len(done) == len(names) else ("Left out: intel, since its log is not there.",),
    )
