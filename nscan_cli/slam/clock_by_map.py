"""The clock of odometry, by the turns of a finished map.

The check of the file measures a few steps before the drive is mapped (calibration/odometry_delay.py and
clock_changes.py). Where a robot seldom turns, or scans tell single turns badly, these may not tell that
odometry is late or early, or from some scan on. A map tells all turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.clock_changes import with_one_clock
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.odometry_delay import delay_by_turns, said_late
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.turn_differences import Turns
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, Mask, are_known


class ClockByMap(NamedTuple):
    """A log whose odometry was put on the clock of its scans."""

    log: LaserLog
    reading: ReadingOptions
    """The options that read it so, but for the stamps of a part."""
    messages: list[str]


def clock_by_map(
    log: LaserLog, poses: Array, breaks: Sequence[int], reading: ReadingOptions, options: FileCheckOptions
) -> ClockByMap | None:
    """The log with its odometry at the time at which its turns fit those of a map; None in doubt.

    The log was read with `reading`. The map has its scans at poses (S, 3). No turn leads over the rows
    `breaks`, at which tracking broke.
    """
    if log.odometry is None:
        return None
    turns = turns_of_map(log.times, poses, breaks, are_known(log.odometry), options)
    # A clock that was set tells an offset between both, too.
    log, said = with_one_clock(log, turns.some(2 * options.more_steps), options.clock_change)
    if said:
        return ClockByMap(log, reading, said)
    delay = delay_by_turns(log, turns, options.lag)
    if not delay:
        return None
    reading = replace(reading, clock_offset=round(reading.clock_offset + delay, 2))
    said = [said_late(delay, reading.clock_offset, "because scans are matched by odometry")]
    return ClockByMap(with_delay(log, delay), reading, said)


def turns_of_map(
    times: Array, poses: Array, breaks: Sequence[int], is_known: Mask, options: FileCheckOptions
) -> Turns:
    """The turns of poses (S, 3) at times (S,), s: one after another, each of about the least that counts.

    None leads over a break, or over rows at which odometry is not known (S,).
    """
    headings = np.unwrap(poses[:, 2])
    turned = np.append(0.0, np.cumsum(np.abs(np.diff(headings))))
    ends = np.flatnonzero(np.diff(np.floor(turned / options.lag.map_turn), prepend=-1.0) > 0.0)
    first, last = ends[:-1], ends[1:]
    segments = np.searchsorted(np.asarray(breaks), ends, side="right")
    unknown = np.append(0, np.cumsum(~is_known))
    kept = (np.diff(segments) == 0) & (unknown[last + 1] == unknown[first])
    kept &= times[last] - times[first] <= options.steps.max_duration
    first, last = first[kept], last[kept]
    return Turns(times[first], times[last], headings[last] - headings[first])
