"""The index set J: which pairs are matched (paper, III-B), on the problems of ten scans of the gauges."""

from __future__ import annotations

from typing import get_args

import numpy as np

from nscan_cli.matching.joint.index_set import IndexSetKind
from tests.experiments.cases import SUCCESS, Case
from tests.experiments.gauge import intel_cases, office_cases
from tests.experiments.report import Report


def report() -> Report:
    """The table."""
    sets = {"simulated office": office_cases(), "intel": intel_cases()}
    return Report(
        "III-B: which pairs are matched",
        "The problems of the gauges again, with three index sets. `all`: all pairs. `visible`: the "
        "position of one scan lies in the free space that the other saw. `overlap` (the default): enough "
        "of one scan's points fall into cells where the other has a Gaussian. The set is chosen from the "
        "poses before each stage. `make bench` has the times. From poor starts `visible` solves fewer "
        "problems, and it loses the pair that ties the scans of Fig. 3. A problem succeeds within "
        f"{SUCCESS} m.",
        {},
        ("set", "pairs", "number of them (median)", "iterations (mean)", "succeeded"),
        [
            [name, kind, *_row(cases, kind)]
            for name, cases in sets.items()
            if cases is not None
            for kind in get_args(IndexSetKind)
        ],
        () if sets["intel"] is not None else ("Left out: intel, since its log is not there.",),
    )


def _row(cases: tuple[Case, ...], kind: IndexSetKind) -> list[str]:
    matched = [case.matched(pairs=kind) for case in cases]
    joint = [each.match.joint for each in matched]
    return [
        f"{np.median([len(match.pairs) for match in joint]):.0f}",
        f"{np.mean([match.iterations for match in joint]):.1f}",
        f"{np.mean([each.succeeded() for each in matched]):.1%}",
    ]
