"""Pairwise matching of a keyframe with each of its neighbours (paper, V: step 3 of the loop).

This is what nScan-Matching is compared with. The same scans are chosen, and the same energy of two scans is
minimised, but each result is a pairwise relation of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.graph.model import Pairwise
from nscan_cli.matching.motion_model import Prior, no_prior
from nscan_cli.matching.pairwise_solver import PairProblem, minimise_pairwise
from nscan_cli.matching.pose_kernels import largest_motion
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.energy import energy, inlier_share
from nscan_cli.poses import Array, inverse, relative, relative_jacobians, wrap
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, scale_of, verdict
from nscan_cli.slam.local_matching.neighbours import Neighbours
from nscan_cli.slam.local_matching.options import NScanOptions


@dataclass(frozen=True)
class _Single:
    """The match of the centre's points with the Gaussians of another keyframe."""

    pose: Array
    """(3,) pose of the centre in the other's frame."""
    overlap: float
    """The greater of the shares of points of one that lie on Gaussians of the other.

    0 when no point of the centre meets a Gaussian of the other, whatever the other's points lie on.
    """
    moved: float
    """How far (m) the match moved the other, seen from the centre."""
    information: Array
    """(3, 3) weighed as in nScan relations: the Hessian of the scaled energy, here without the prior."""


def match_neighbours_pairwise(
    route: Route, centre: int, near: Neighbours, options: NScanOptions
) -> LocalMatch | None:
    """Match a keyframe with each of its neighbours, and keep the matches with enough overlap.

    Arguments as for match_neighbours. The loop is accepted if a match with a keyframe of another visit is
    kept. None if no other keyframe is near.
    """
    keyframes = route.keyframes
    is_other = near.members != centre
    others, from_other_visit = near.members[is_other], near.from_other_visit[is_other]
    if len(others) == 0:
        return None
    singles = [_match(route, int(other), centre, options) for other in others]
    overlaps = np.array([single.overlap for single in singles])
    kept = overlaps >= options.min_overlap
    relations = tuple(
        Pairwise(
            nodes=(keyframes[other].row, keyframes[centre].row),
            measurement=single.pose,
            information=single.information,
            origin="loop" if seen else "track",
            score=single.overlap,
        )
        for other, seen, single, keep in zip(others, from_other_visit, singles, kept, strict=True)
        if keep
    )
    closed, whole = bool((kept & from_other_visit).any()), bool(kept.all())
    if closed:
        reason = "" if whole else f"{counted(int((~kept).sum()), 'scan')} left out"
    else:
        reason = f"too little overlap with {counted(int(from_other_visit.sum()), 'scan')} of another visit"
    best = float(overlaps[from_other_visit].max(initial=0.0))
    used = kept if closed else np.ones(len(others), dtype=bool)
    loop = verdict(keyframes, others[used], from_other_visit[used], centre, closed, reason, best)
    moved = max((single.moved for single, keep in zip(singles, kept, strict=True) if keep), default=0.0)
    return LocalMatch(relations, None, loop, moved, whole)


def _match(route: Route, other: int, centre: int, options: NScanOptions) -> _Single:
    """The match of the centre with one other keyframe, from their poses in the graph."""
    keyframes, poses = route.keyframes, route.poses
    reference, points = keyframes[other].ndt, keyframes[centre].points
    prior = _prior(route.chain, other, centre)
    scale = scale_of([keyframes[centre]], options)
    start, origin, tolerance = relative(poses[centre], poses[other]), np.zeros(3), options.tolerance
    for widenings in options.attempts:
        pose, hessian = start.copy(), np.empty((3, 3))
        problem = PairProblem(reference.grid, reference.half, begin_association(points), scale, prior)
        minimise_pairwise(
            problem, pose, np.array(widenings), options.max_iterations, tolerance, tolerance, hessian
        )
        pose[2] = wrap(pose[2])
        moved = largest_motion(np.stack([origin, start]), np.stack([origin, pose]), 1)[0]
        overlap = _overlap(keyframes[other], keyframes[centre], pose, options.inlier_bound)
        if overlap >= options.min_overlap and moved < options.max_last_stage_motion:
            break
    information = scale * energy(reference, points, pose, exact=False).hessian
    return _Single(pose, overlap if information.any() else 0.0, moved, information)


def _prior(chain: Sequence[Pairwise], other: int, centre: int) -> Prior:
    """The prior of tracking on the centre's pose in the other's frame; no information unless one follows the
    other."""
    if other == centre - 1:
        return Prior(chain[other].measurement, chain[other].information)
    if other == centre + 1:
        mean = inverse(chain[centre].measurement)
        # The measurement is the inverse of the pose that is asked for.
        _, by_pose = relative_jacobians(np.zeros(3), mean)
        return Prior(mean, np.ascontiguousarray(by_pose.T @ chain[centre].information @ by_pose))
    return no_prior()


def _overlap(other: Keyframe, centre: Keyframe, pose: Array, inlier_bound: float) -> float:
    """The overlap of two keyframes, as in matching.joint.overlap; `pose` (3,) is the centre's in the other's
    frame."""
    ndt, own = other.ndt, centre.ndt
    on_other = inlier_share(ndt.grid, ndt.half, centre.points, pose, inlier_bound)
    on_centre = inlier_share(own.grid, own.half, other.points, inverse(pose), inlier_bound)
    return max(on_other, on_centre)
