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
    paper_row,
    real_case,
    run,
    simulated_case,
)
from tests.experiments.reference import reference_log
from tests.experiments.report import Report
from tests.matching.problems import office_truth
from tests.simulation.drive import Odometry, odometry
from tests.simulation.scenes import office

OFFICE_ROWS = np.arange(480, 600, 12)
"""Of the drive: through the corridor and into the lounge, 1 m apart."""
SEED = 2
POOR = Odometry(
    distance_noise=0.03,
    turn_noise_driving=np.radians(2.0),
    turn_noise_turning=np.radians(3.0),
    scale=1.06,
    veer=np.radians(1.5),
)
"""The odometry of a cart with soft wheels: that of the drive itself drifts too little in ten scans."""
INTEL_CHOSEN = np.arange(1320, 1340, 2)
"""Of the scans with reference poses, which are 0.35 m apart: along a corridor to its end."""


@functools.cache
def outcomes() -> tuple[Outcome, ...]:
    """The simulated office, and intel where it is there."""
    return tuple(run(case) for case in (office_case(), intel_case()) if case is not None)


def office_case() -> Case:
    """Ten scans of the simulated office."""
    truth = office_truth()[OFFICE_ROWS]
    driven = odometry(truth, POOR, np.random.Generator(np.random.PCG64(SEED)))
    return simulated_case(office(), OFFICE_ROWS, driven, SEED)


def intel_case() -> Case | None:
    """Ten scans of intel; None where the log is not there."""
    intel = reference_log("intel")
    if intel is None:
        return None
    assert intel.log.odometry is not None
    return real_case(intel, INTEL_CHOSEN, intel.log.odometry[intel.rows[INTEL_CHOSEN]])


def report() -> Report:
    """Pictures and table."""
    done = outcomes()
    names = ("fig_4_office", "fig_4_intel")
    return Report(
        "Fig. 4: ten scans from odometry",
        "Ten scans start where the odometry says they were taken; all 90 pairs are matched at once, with "
        "no prior and the gauge free. The errors are the greatest of all scans, seen from the first, "
        "against the simulated truth or, on intel, against poses that the reference relations of "
        "Kümmerle et al. 2009 give by least squares. Iterations and evaluations are those of all stages "
        "of both matches that `nscan` makes from a start; an evaluation is one of the joint energy with "
        f"gradient and Hessian. The good start is drawn up to {GOOD} m and {GOOD_ANGLE} rad off the truth, "
        "and matched by the last stage alone. These are examples that succeed; they do not tell how many do.",
        {name: outcome.picture() for name, outcome in zip(names, done, strict=False)},
        HEADER,
        [*(outcome.row() for outcome in done), paper_row(10, 30, 267)],
        () if len(done) == len(names) else ("Left out: intel, since its log is not there.",),
    )
