"""Parts of a log, and its true poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array

Rows = slice | NDArray[np.int64]


def truth_of(log: LaserLog) -> Array:
    """(S, 3) true poses; the logs of the tests have one for every scan."""
    assert log.truth is not None
    assert len(log.truth) == len(log)
    return log.truth


def excerpt(log: LaserLog, rows: Rows) -> LaserLog:
    """The scans in `rows` alone, in that order, with the numbers that they have in the whole log."""
    return replace(
        log,
        numbers=log.numbers[rows],
        stamps=tuple(np.array(log.stamps)[rows].tolist()),
        times=log.times[rows],
        ranges=log.ranges[rows],
        angle_min=log.angle_min[rows],
        angle_increment=log.angle_increment[rows],
        mount=log.mount[rows] if log.mount.ndim == 2 else log.mount,
        odometry=None if log.odometry is None else log.odometry[rows],
        beams=None if log.beams is None else log.beams[rows],
        truth_times=None if log.truth is None else log.times[rows],
        truth=None if log.truth is None else truth_of(log)[rows],
    )
