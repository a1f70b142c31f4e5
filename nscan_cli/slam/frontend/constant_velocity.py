"""The prediction without odometry: the robot goes on with the mean velocity of its last steps.

The mean of how many steps predicts best differs from log to log, and so does whether the robot goes as far in
each scan or in each second. The newest step alone follows turns, the mean of several evens out jitter. Where
scans are recorded after so many metres, steps are as long as the time between them; where stamps come in
bursts, they are not. So each kind of mean is tried on every scan that tells its place, and the one that has
predicted best so far predicts the next scan; its place and its turn each by itself.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.odometry_checks import SHORTEST_PERIOD
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.track_state import KNOWN, TrackState

PLACE, TURN = 0, 1
"""Rows of `TrackState.prediction_errors`: how far off predictions are in place (m) and in turn (rad)."""


@kernel
def steps_ahead(track: TrackState, options: ScanTrackingOptions, time: float, steps: Array) -> int:
    """Write the steps (2, h, 3) to the next scan, at `time` (s), by the mean of the last 1 to h steps.

    They are those of a robot that goes as far in each scan, and as far in each second. Returns how many steps
    are known.
    """
    last, known = track.poses[-1], int(track.counts[KNOWN]) - 1
    for n in range(1, known + 1):
        relative_pose(last, track.poses[-1 - n], steps[0, n - 1])
        steps[0, n - 1, 2] = wrapped(steps[0, n - 1, 2])
        period = max(abs(track.times[-1] - track.times[-1 - n]) / n, SHORTEST_PERIOD)
        pace = min(abs(time - track.times[-1]) / period, options.longest_pause)
        for a in range(3):
            steps[0, n - 1, a] /= n
            steps[1, n - 1, a] = steps[0, n - 1, a] * pace
    return known


@kernel
def constant_velocity(
    track: TrackState, options: ScanTrackingOptions, time: float, is_steady: bool, step: Array
) -> None:
    """Write the step (3,) to the next scan, at `time` (s), by the mean that has predicted best so far.

    `is_steady` allows only the mean of all steps. Without any the robot stands.
    """
    steps = np.empty((2, track.poses.shape[0] - 1, 3))
    known = steps_ahead(track, options, time, steps)
    step[:] = 0.0
    for row in (PLACE, TURN):
        least = np.inf
        for n in range(known, known - 1 if is_steady else 0, -1):
            for kind in range(2):
                error = track.prediction_errors[row, kind, n - 1]
                if error < least:
                    least = error
                    if row == PLACE:
                        step[0], step[1] = steps[kind, n - 1, 0], steps[kind, n - 1, 1]
                    else:
                        step[2] = steps[kind, n - 1, 2]


@kernel
def expected_errors(track: TrackState) -> tuple[float, float]:
    """The mean errors of the best predictions so far, in place (m) and turn (rad); infinite at first."""
    known, place, turn = track.counts[KNOWN] - 1, np.inf, np.inf
    if known < track.poses.shape[0] - 1:
        return place, turn
    for kind in range(2):
        for n in range(known):
            place = min(place, track.prediction_errors[PLACE, kind, n])
            turn = min(turn, track.prediction_errors[TURN, kind, n])
    return place, turn


@kernel
def learn_prediction(track: TrackState, options: ScanTrackingOptions, time: float, pose: Array) -> None:
    """Update the mean errors of all predictions by the scan at `time` (s), matched at `pose` (3,)."""
    steps, step = np.empty((2, track.poses.shape[0] - 1, 3)), np.empty(3)
    known = steps_ahead(track, options, time, steps)
    if known < track.poses.shape[0] - 1:
        return
    relative_pose(pose, track.poses[-1], step)
    step[2] = wrapped(step[2])
    for kind in range(2):
        for n in range(known):
            x, y = steps[kind, n, 0] - step[0], steps[kind, n, 1] - step[1]
            turn = abs(wrapped(steps[kind, n, 2] - step[2]))
            errors = track.prediction_errors
            errors[PLACE, kind, n] += options.prediction_smoothing * (np.hypot(x, y) - errors[PLACE, kind, n])
            errors[TURN, kind, n] += options.prediction_smoothing * (turn - errors[TURN, kind, n])
