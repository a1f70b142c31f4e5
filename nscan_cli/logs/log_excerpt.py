"""Some scans of a log, or some beams of all, as a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.laser_log import LaserLog

Rows = slice | NDArray[np.int64]


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
        odometry=None if log.odometry is None else log.odometry[rows],
        beams=None if log.beams is None else log.beams[rows],
        beam_times=None if log.beam_times is None else log.beam_times.of(rows),
    )


def with_some_beams(log: LaserLog, every: int) -> LaserLog:
    """The scans with one beam in `every`, from the first on."""
    times = log.beam_times
    return replace(
        log,
        ranges=np.ascontiguousarray(log.ranges[:, ::every]),
        angle_increment=every * log.angle_increment,
        beams=None if log.beams is None else -(-log.beams // every),
        beam_times=None if times is None else BeamTimes(times.first, every * times.step),
    )
