"""What the file says of odometry and mounting, compared with the steps of a finished map.

The check of the file (calibration/file_check.py) matches a few steps before the drive is mapped. Outdoors,
and where a robot seldom turns, few of them tell. A map tells every step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.calibration.contradictions import find_contradictions
from nscan_cli.calibration.findings import Finding
from nscan_cli.calibration.measured_steps import KnownSteps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_sampling import possible_steps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, relative


def contradictions_by_map(
    log: LaserLog, poses: Array, breaks: Sequence[int], reading: ReadingOptions, options: FileCheckOptions
) -> list[Finding]:
    """The scale, the mounting, or the turns that the map of a log contradicts, which was read with `reading`.

    It has the scans at poses (S, 3). No step leads over the rows `breaks`, at which tracking broke. Whatever
    else is wrong with odometry, its map may be wrong as well.
    """
    found = find_contradictions(log, reading, options, steps_of_map(log, poses, breaks, options))
    is_left_open = [not (each.corrected or each.is_of_clocks or each.is_of_view) for each in found]
    return found if all(is_left_open) else []


def steps_of_map(log: LaserLog, poses: Array, breaks: Sequence[int], options: FileCheckOptions) -> KnownSteps:
    """All steps that the check of the file may measure, as poses (S, 3) of a map tell them."""
    first, last = possible_steps(log, options.steps)
    lasers = log.laser_pose(poses)
    steps = relative(lasers[last], lasers[first])
    segments = np.searchsorted(np.asarray(breaks), np.arange(len(poses)), side="right")
    is_whole = segments[first] == segments[last]
    covariance = np.diag(np.square(options.map_sigmas))
    return {
        pair: (step, covariance) if whole else None
        for pair, step, whole in zip(
            zip(first.tolist(), last.tolist(), strict=True), steps, is_whole, strict=True
        )
    }
