"""Headings by odometry that count the wrong way beside positions that are right.

A robot drives the way that it heads, or always some other way. If the headings alone are reversed, it seems
to drive each way in its own frame, as it turns. Odometry that turns the wrong way and adds up its steps, or
readings in the wrong order, leave it driving the way that it heads.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.changed_odometry import with_changed_odometry
from nscan_cli.calibration.driving_direction import driving_direction
from nscan_cli.calibration.findings import UNDONE, mirrored_instead
from nscan_cli.calibration.measured_steps import KnownSteps, measure_steps
from nscan_cli.calibration.odometry_fault_options import ReversedHeadingOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, are_known

HEADINGS_REVERSED = np.array([1.0, 1.0, -1.0])
"""Factors of poses."""


def checked_headings(
    log: LaserLog, reading: ReadingOptions, options: FileCheckOptions, known: KnownSteps
) -> tuple[LaserLog, list[str]]:
    """The log with the headings of its odometry reversed if its positions and its scans say so, and messages.

    Scans are matched only if the positions do.
    """
    if log.odometry is None or not contradict_positions(log.odometry, options.headings):
        return log, []
    # With y the wrong way odometry contradicts itself, too, but turns as the scans do.
    rows = telling_steps(log, options.steps, options.more_steps)
    steps = measure_steps(log, rows, options.steps, known=known, turns_alone=True)
    seen, told = steps.laser[:, 2], steps.odometry(log.odometry)[:, 2]
    turning = np.isfinite(told) & (np.abs(seen) >= options.steps.min_motion)
    opposite = seen[turning] * told[turning] < 0.0
    is_most = np.count_nonzero(opposite) >= options.headings.min_opposite_share * len(opposite)
    if len(opposite) < options.headings.min_turns or not is_most:
        return log, []
    some = f"{np.count_nonzero(opposite)} of {counted(len(opposite), 'turn')}"
    message = (
        "odometry counts headings the wrong way: with the other sign the robot drives the way that it heads, "
        f"and turns as the scans do, in {some}; the sign is changed; {UNDONE}{mirrored_instead(reading)}"
    )
    return with_changed_odometry(log, lambda poses, _times: poses * HEADINGS_REVERSED), [message]


def contradict_positions(odometry: Array, options: ReversedHeadingOptions) -> bool:
    """Whether a robot at poses (S, 3) drives one way in its own frame only with reversed headings."""
    known = odometry[are_known(odometry)]
    reversed_too = _agreement(known * HEADINGS_REVERSED, options)
    if reversed_too < options.min_agreement:
        return False
    return _agreement(known, options) <= reversed_too - options.min_gain


def _agreement(poses: Array, options: ReversedHeadingOptions) -> float:
    """The length of the mean of the directions of steps, in the robot's frame; 0 for few."""
    return float(np.hypot(*driving_direction(poses, options.min_driven, options.min_driven_steps)))
