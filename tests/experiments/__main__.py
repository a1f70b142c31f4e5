"""Writes pictures and tables of all experiments: `python -m tests.experiments FOLDER`.

The pictures go into the folder, the document experiments.md beside it. The same bytes every time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from tests.experiments import comparison, fig_2, fig_3, fig_4, fig_5, gauge, index_sets, transformation
from tests.experiments.output import write_reports
from tests.experiments.report import Report

EXPERIMENTS: tuple[Callable[[], Report], ...] = (
    fig_2.report,
    fig_3.report,
    fig_4.report,
    fig_5.report,
    gauge.report,
    index_sets.report,
    transformation.report,
    comparison.report,
)


def main(folder: str) -> None:
    """Run every experiment and write its results to `folder`, which has to exist."""
    reports = [experiment() for experiment in EXPERIMENTS]
    for path in write_reports(reports, Path(folder)):
        print(path.name)
    for report in reports:
        for line in report.left_out:
            print(line)


if __name__ == "__main__":
    main(sys.argv[1])
