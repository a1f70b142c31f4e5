"""Odometry that comes less often than its log says: the last pose is repeated until there is a new one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.robot_path import steady_between
from nscan_cli.poses import Array, are_known


@dataclass(frozen=True)
class SlowOdometryOptions:
    """When poses repeat each other because odometry is slow, and not because the robot stands."""

    min_share: float = 0.5
    """Least share of the steps with motion that follow one without. It is 0.015 at most on real logs. A
    larger value corrects fewer logs."""
    min_steps: int = 10
    """Least number of these steps. A larger value corrects fewer logs."""
    min_change: float = 0.5
    """Least change of the readings while a pose is repeated, as a share of that when it changes: else the
    robot stops for each scan. A larger value corrects fewer logs."""
    scans: int = 50
    """Number of repeated poses whose readings are compared. More take longer."""
    max_duration: float = 2.0
    """Longest usual time that a pose is repeated, s: over a longer one steady motion tells little. A larger
    value corrects more logs."""
    longest: float = 2.0
    """Repeats that last longer than this multiple of the usual are those of a robot that stands. A larger
    value lets it stand less."""


def without_repeats(
    odometry: Array, times: Array, scans: tuple[NDArray[np.float32], NDArray[np.int64]] | None = None
) -> tuple[Array, str]:
    """Odometry (S, 3) at times (S,), s, steady between two poses that differ if it is slow; and what to say.

    scans: readings (S, B), m, and the rows (S,) of them at these times; None if the times are those of
    odometry. The text is empty where nothing is changed. Unknown poses are nan and stay so.
    """
    options = SlowOdometryOptions()
    stands = (odometry[1:] == odometry[:-1]).all(axis=1)
    moves = ~stands & are_known(odometry[1:]) & are_known(odometry[:-1])
    ends = np.flatnonzero(moves[1:] & stands[:-1]) + 1
    if len(ends) < max(options.min_steps, options.min_share * np.count_nonzero(moves)):
        return odometry, ""
    # A pose is repeated from the first scan that has it, until the last one, which has another.
    changes = np.flatnonzero(~stands)
    before = np.searchsorted(changes, ends) - 1
    repeats = np.stack([np.where(before >= 0, changes[before] + 1, 0), ends + 1], axis=1)
    if scans is not None and not _robot_drives(repeats, *scans):
        return odometry, ""
    durations = np.diff(times[repeats], axis=1)[:, 0]
    usual = float(np.median(durations))
    if usual > options.max_duration:
        return odometry, ""
    is_drive = (durations > 0.0) & (durations <= options.longest * usual)
    evened = steady_between(odometry, times, repeats[is_drive].tolist())
    return evened, (
        f"odometry comes less often than the log says: it repeats each pose for {usual:.2g} s; between two "
        "that differ the robot is taken to move steadily; --as-recorded believes the log"
    )


def _robot_drives(repeats: NDArray[np.int64], readings: NDArray[np.float32], rows: NDArray[np.int64]) -> bool:
    """Whether readings (S, B) change as much while a pose is repeated as when it changes.

    rows: those of the readings (S,) in order of time.
    """
    changing: list[bool] = []
    for first, last in repeats[:: max(1, len(repeats) // SlowOdometryOptions.scans)].tolist():
        some = readings[rows[[first, last - 1, last]]]
        some = some[:, (np.isfinite(some) & (some > 0)).all(axis=0)]
        if some.size:
            meanwhile, at_change = np.median(np.abs(np.diff(some, axis=0)), axis=1).tolist()
            changing.append(meanwhile >= SlowOdometryOptions.min_change * at_change)
    return 2 * sum(changing) > len(changing)
