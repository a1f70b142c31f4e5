"""Deskewing once more: scans of a turning laser are corrected by the path of the optimised graph.

Tracking knows the motion during a sweep from odometry, or from the scans before alone. The final path has
poses on both sides of each sweep, and more of them where the motion is uneven and odometry does not tell it.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from nscan_cli.graph.model import Pairwise
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.logs.robot_path import poses_at
from nscan_cli.poses import Array, Mask, compose, inverse, relative
from nscan_cli.slam.backend.scan_poses import between_keyframes
from nscan_cli.slam.backend.uneven_motion import path_of_sweeps
from nscan_cli.slam.frontend.scan_batch import scan_batches
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.keyframes.route import route_of
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.state import SlamState


def deskew_by_final_path(state: SlamState) -> None:
    """Bring all scans to the times of their stamps, deskewed by the path of the robot.

    Changes log, keyframes, chain, tracked, route and energies, if the laser turns.
    """
    if state.log.beam_times is None:
        return
    rows, breaks = state.route.rows, set(state.breaks)
    turn, tracked = state.options.optimisation.metres_per_radian, np.concatenate(state.tracked)
    at_middle = between_keyframes(tracked, rows, state.poses, state.breaks, turn)
    path = path_of_sweeps(state.log, at_middle, state.breaks, state.options)
    poses = at_middle if path is None else poses_at(path, state.recorded.times)
    since_middle = relative(poses, at_middle)
    before = state.keyframes.list
    state.log = dataclasses.replace(state.recorded, path=path)
    state.tracked = [poses]
    state.chain = [
        _between_moved(relation, since_middle[relation.nodes[0]], since_middle[relation.nodes[1]])
        for relation in state.chain
    ]
    state.keyframes = state.keyframes.without_any()
    is_keyframe = np.zeros(len(poses), dtype=np.bool_)
    is_keyframe[rows] = True
    add_keyframes_at(state, tracked_at(poses, breaks, state.options), is_keyframe, breaks)
    for keyframe, known in zip(state.keyframes.list, before, strict=True):
        keyframe.tracked = dataclasses.replace(known.tracked, pose=keyframe.tracked.pose)
        keyframe.prior_covariance = known.prior_covariance
    state.route = route_of(state.keyframes.list, state.chain, poses[rows])
    state.energies.forget()


def _between_moved(relation: Pairwise, first: Array, second: Array) -> Pairwise:
    """A relation of two nodes after each has moved by a pose (3,), in its own frame."""
    measurement = compose(inverse(first), compose(relation.measurement, second))
    return dataclasses.replace(relation, measurement=measurement)


def add_keyframes_at(state: SlamState, found: TrackedScans, is_keyframe: Mask, breaks: set[int]) -> None:
    """Add keyframes with their Gaussians, from all scans (S,) where they were `found`."""
    keyframes = state.keyframes
    # Points are computed only of the scans that make Gaussians.
    used = np.flatnonzero(found.in_map | is_keyframe)
    log, frozen = excerpt(state.log, used), np.flatnonzero(np.isin(used, state.frozen_scans))
    after_break = np.zeros(len(used) + 1, dtype=np.bool_)
    after_break[np.searchsorted(used, sorted(breaks))] = True
    for scans in scan_batches(log, state.options.tracking, None, frozen):
        batch = slice(scans.first, scans.first + len(scans))
        rows, begins, first = used[batch], after_break[batch], 0
        those, is_own = found.of(rows), is_keyframe[rows]
        for k in np.flatnonzero(begins | is_own).tolist():
            keyframes.attach(scans, those, first, k)
            if begins[k]:
                keyframes.end_segment()
            if is_own[k]:
                keyframes.add(int(rows[k]), scans.of(k), those.scan(k))
                for whole in keyframes.list[-2:-1]:
                    whole.make_ndt()
            first = k + int(is_own[k])
        keyframes.attach(scans, those, first, len(rows))
    keyframes.end_segment()


def tracked_at(poses: Array, breaks: set[int], options: SlamOptions) -> TrackedScans:
    """The scans as if tracking had found them at poses (S, 3), without information."""
    found, step, path = TrackedScans.room(len(poses)), options.tracking.scan.min_motion, 0.0
    found.poses[:], found.values[:], found.inliers[:] = poses, 0.0, 1.0
    found.hessians[:], found.prior_covariances[:], found.odometry_sigmas[:] = 0.0, 0.0, 0.0
    joined = poses[0].tolist()
    for row, pose in enumerate(poses.tolist()):
        distance = math.hypot(pose[0] - joined[0], pose[1] - joined[1])
        turn = abs(math.remainder(pose[2] - joined[2], math.tau))
        found.in_map[row] = row == 0 or distance > step or turn > step
        if found.in_map[row]:
            path, joined = path + distance, pose
        if row in breaks:
            path += options.breaks.path
        found.paths[row] = path
    return found
