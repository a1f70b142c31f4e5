"""The offset of odometry's clock from that of the scans: the one with which their turns agree best.

It may be as long as two minutes, as where two computers recorded. It is put right, unless the user gave one,
and then named; `calibrate` refines it. odometry_delay.py and sweep_delay.py find delays up to 1.5 s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.calibration.measured_steps import MeasuredSteps
from nscan_cli.calibration.odometry_options import ClockOptions
from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.turn_differences import are_told, turn_differences
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import are_known


@dataclass(frozen=True)
class ClockOffset:
    """The offset that makes turns by odometry agree best with those by scans."""

    offset: float
    """s to add to the stamps of the odometry."""
    disagreement: float
    """Sum of the differences of turns there, as a share of the sum of turns by scans; each is capped."""
    as_stamped: float
    """This share without an offset."""
    elsewhere: float
    """Median of this share over all offsets: that of turns that have nothing in common."""


def clock_offset(
    log: LaserLog, steps: MeasuredSteps, options: ClockOptions, turn_sign: float = 1.0
) -> ClockOffset | None:
    """The best offset within half of the log's length, to about a tenth of the resolution.

    None without turns. `turn_sign` −1 compares with the turns of mirrored scans.
    """
    assert log.odometry is not None
    known = are_known(log.odometry)
    turns = turn_sign * steps.laser[:, 2]
    whole = float(np.minimum(np.abs(turns), options.max_difference).sum())
    if known.sum() < 2 or whole == 0.0:
        return None
    at, headings = log.times[known], np.unwrap(log.odometry[known, 2])
    begins, ends = log.times[steps.first], log.times[steps.last]

    resolution = options.resolution
    span = min(options.span, 0.5 * float(log.times[-1] - log.times[0]))
    count = int(np.ceil(span / resolution))
    offsets = resolution * np.arange(-count, count + 1, dtype=np.float64)
    differences = turn_differences((at, headings), (begins, ends), turns, offsets)
    # A turn that odometry does not tell, for it stands or is missing there, says nothing of an offset.
    told = are_told(at, (begins, ends), offsets, options.longest_gap)
    sizes = (told * np.minimum(np.abs(turns), options.max_difference)).sum(axis=1)
    off = np.ones(len(offsets))
    off_told = (told * np.minimum(differences, options.max_difference)).sum(axis=1)
    np.divide(off_told, sizes, out=off, where=sizes > options.min_told * whole)
    best = int(np.argmin(off))
    is_inside = 0 < best < len(off) - 1
    offset = parabola_minimum(offsets, off) if is_inside else float(offsets[best])
    return ClockOffset(offset, float(off[best]), float(off[count]), float(np.median(off)))
