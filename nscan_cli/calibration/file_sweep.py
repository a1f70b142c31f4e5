"""The sweep of the laser as a log is read: how long it takes, and at which beam its scans are stamped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.sweep import BEFORE_STAMP, beam_times
from nscan_cli.poses import Array


def file_sweep_times(log: LaserLog) -> Array:
    """(S,) the times of the sweeps, s, negative where the readings are in the reverse order; 0: at once."""
    if log.beam_times is None:
        return np.zeros(len(log))
    return log.beam_times.step * 2 * np.pi / np.abs(log.angle_increment)


def with_sweep_times(log: LaserLog, seconds: Array, stamp: str) -> LaserLog:
    """The log of a laser whose sweeps take `seconds` (S,) each, and whose scans are stamped at `stamp`."""
    return replace(log, beam_times=beam_times(seconds, log.angle_increment, log.beam_counts(), stamp))


def usual_sweep_time(log: LaserLog) -> float:
    """The usual time of a sweep, s; 0 if the file has none."""
    return float(np.median(file_sweep_times(log)))


def stamp_place(log: LaserLog, stamp: str, delay: float, options: SweepCheckOptions) -> str | None:
    """The beam that scans are stamped at if odometry, read as if they were at `stamp`, is `delay` (s) early.

    None if no beam explains that, or the laser sees at once.
    """
    lasts = first_to_last(log)
    left = {
        place: abs(delay - (share - BEFORE_STAMP[stamp]) * lasts) for place, share in BEFORE_STAMP.items()
    }
    place = min(left, key=lambda each: left[each])
    return place if left[place] < options.stamp_tolerance * 0.5 * lasts else None


def stamp_delays(log: LaserLog, stamp: str) -> list[float]:
    """How early odometry seems (s) if scans that are read as if at `stamp` are stamped at another beam."""
    lasts = first_to_last(log)
    return [(share - BEFORE_STAMP[stamp]) * lasts for place, share in BEFORE_STAMP.items() if place != stamp]


def first_to_last(log: LaserLog) -> float:
    """The usual time from the first beam of a scan to the last, s; 0 if all are seen at once."""
    if log.beam_times is None:
        return 0.0
    return float(np.median(np.abs(log.beam_times.step) * np.maximum(log.beam_counts() - 1, 0)))
