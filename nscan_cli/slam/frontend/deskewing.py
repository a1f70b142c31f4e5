"""Deskewing while tracking without odometry: scans of a turning laser are corrected by the last step.

Poses are those at the middle of each sweep. During one the robot is assumed to go on as in the step between
the last two: half a step before the middle, and half a step after it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.robot_path import move_along_arc
from nscan_cli.matching.pose_kernels import relative_pose, wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.track_state import KNOWN, TrackState


@kernel
def deskew_by_last_step(track: TrackState, points: Array, shares: Array, step: Array) -> None:
    """Write the last step to `step` (3,), and deskew the points (m, 2) of the next scan by it, in place.

    `shares` (m,) are the times of the points from the middle of the turn, in periods of the scans. The step
    is zero before two poses are known.
    """
    step[:] = 0.0
    if track.counts[KNOWN] > 1:
        relative_pose(track.poses[-1], track.poses[-2], step)
        step[2] = wrapped(step[2])
    move_along_arc(points, shares, step, False)


@kernel
def deskew_by_match(
    track: TrackState, options: ScanTrackingOptions, points: Array, shares: Array, step: Array, pose: Array
) -> bool:
    """Deskew points anew, in place, if the scan's match at `pose` (3,) has another step than `step` (3,).

    Returns whether they have changed. They count as deskewed from now on: `shares` (m,) become zero.
    """
    found = np.empty(3)
    relative_pose(pose, track.poses[-1], found)
    found[2] = wrapped(found[2])
    bound = options.sweep_step_change
    differs = np.hypot(found[0] - step[0], found[1] - step[1]) > bound or abs(found[2] - step[2]) > bound
    if differs:
        move_along_arc(points, shares, step, True)
        move_along_arc(points, shares, found, False)
    shares[:] = 0.0
    return bool(differs)
