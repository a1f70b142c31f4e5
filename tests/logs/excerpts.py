"""Parts of a log, and its true poses."""

from __future__ import annotations

from dataclasses import replace

from nscan_cli.logs import log_excerpt
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.log_excerpt import Rows
from nscan_cli.poses import Array

__all__ = ["Rows", "excerpt", "truth_of"]


def truth_of(log: LaserLog) -> Array:
    """(S, 3) true poses; the logs of the tests have one for every scan."""
    assert log.truth is not None
    assert len(log.truth) == len(log)
    return log.truth


def excerpt(log: LaserLog, rows: Rows) -> LaserLog:
    """The scans in `rows` alone, in that order, with their true poses."""
    return replace(
        log_excerpt.excerpt(log, rows),
        truth_times=None if log.truth is None else log.times[rows],
        truth=None if log.truth is None else truth_of(log)[rows],
    )
