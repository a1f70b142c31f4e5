"""Free-space violations: where one visit of a place looks through what another one saw.

A joint match asks where points meet walls. In a corridor they do 6 m farther on, too, and a map that is wrong
by this much closes its loops without any contradiction between relations. The beams that end behind a wall
give it away: from there the other visit saw a door.

Glass, people and low things are looked through in a sound map, too, in one building more than in another. The
same comparison within a visit, where the map is right, measures how much is usual.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.seen_at_once import ranges_at_once
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.poses import Array, Indices, inverse, transform
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.options import FreeSpaceOptions
from nscan_cli.threads import map_in_threads

KEYFRAMES_PER_THREAD = 64
"""Keyframes that a thread compares at a time."""


class FreeSpaceViolation(NamedTuple):
    """The stretch of the path whose keyframes contradict earlier visits most."""

    share: float
    """Share of the points in view of another visit that it looked through."""
    within: float
    """The greatest such share of a stretch within visits; nan where too little was compared."""
    first: int
    """Row of the first keyframe of the stretch."""
    last: int
    """Row of its last keyframe."""


class VisitViews(NamedTuple):
    """What K scans saw, and from where."""

    poses: Array
    """(K, 3) poses of the laser."""
    paths: Array
    """(K,) lengths of path, m."""
    points: Array
    """(P, 2) one scan after another, each in the laser's frame."""
    ends: Indices
    """(K + 1,) scan k has points[ends[k] : ends[k + 1]]."""
    ranges: NDArray[np.float32]
    """(K, B) m, not finite where nothing is known."""
    beams: Array
    """(K, 2) direction of the first beam, and from one to the next, rad."""


def sound_share(within: float, options: FreeSpaceOptions) -> float:
    """The largest share that a sound map explains, where this share is looked through within visits."""
    allowed = options.within_factor * within + options.margin
    return options.max_share if np.isnan(within) else min(allowed, options.max_share)


def is_sound(worst: FreeSpaceViolation, options: FreeSpaceOptions) -> bool:
    """Whether a sound map explains it."""
    return worst.share <= sound_share(worst.within, options)


def free_space_violations(
    log: LaserLog, route: Route, nscan: NScanOptions, options: FreeSpaceOptions, threads: int = 1
) -> FreeSpaceViolation | None:
    """The worst stretch of the route's K keyframes; None where no place was seen again.

    Keyframes of other visits within the radius of joint matches are compared.
    """
    rows = route.rows
    if not len(rows) or log.ranges.shape[1] < 2:
        return None
    if not _are_seen_again(log.laser_pose(route.poses), route.paths, nscan, options.min_keyframes):
        return None
    to_laser = inverse(log.mount)
    points = [transform(to_laser, keyframe.points) for keyframe in route.keyframes[: len(route.poses)]]
    views = VisitViews(
        log.laser_pose(route.poses),
        route.paths,
        np.concatenate(points),
        np.cumsum([0, *map(len, points)]),
        ranges_at_once(log, rows),
        np.stack([log.angle_min[rows], log.angle_increment[rows]], axis=1),
    )
    bounds = nscan.radius, nscan.visit_path
    parts = map_in_threads(
        threads,
        lambda first: _compare_views(views, first, first + KEYFRAMES_PER_THREAD, *bounds, options),
        range(0, len(rows), KEYFRAMES_PER_THREAD),
    )
    counts = np.concatenate(parts)
    again = np.flatnonzero(counts[:, 0].sum(axis=1) >= options.min_points)
    if len(again) < options.min_keyframes:
        return None
    size = min(options.keyframes, len(again))
    sums = np.cumsum(np.concatenate([np.zeros((1, 2, 2), dtype=np.int64), counts[again]]), axis=0)
    compared = sums[size:] - sums[:-size]
    others, within = compared[:, 0], compared[compared[:, 1].sum(axis=1) >= options.min_points, 1]
    shares = others[:, 1] / others.sum(axis=1)
    worst = int(np.argmax(shares))
    first, last = rows[again[[worst, worst + size - 1]]].tolist()
    usual = float((within[:, 1] / within.sum(axis=1)).max()) if len(within) else np.nan
    return FreeSpaceViolation(float(shares[worst]), usual, first, last)


def _are_seen_again(poses: Array, paths: Array, nscan: NScanOptions, least: int) -> bool:
    """Whether at least so many keyframes have one of another visit within the radius of joint matches.

    If few have, it need not be worked out what they saw. `poses` (K, 3) are those of the laser, at lengths of
    path (K,), m.
    """
    older, again = np.searchsorted(paths, paths - nscan.visit_path), 0
    for k in np.flatnonzero(older).tolist():
        away = poses[: older[k], :2] - poses[k, :2]
        again += int((np.hypot(away[:, 0], away[:, 1]) <= nscan.radius).any())
        if again >= least:
            return True
    return False


@kernel
def _compare_views(
    views: VisitViews, first: int, end: int, radius: float, recent: float, options: FreeSpaceOptions
) -> Indices:
    """What keyframes `first` to `end` and earlier ones see of each other: (k, 2, 2) numbers of points.

    The second axis is other visits, same visit; the third is points where the other saw them, points that it
    looked through. The nearest keyframes of each kind within `radius` (m) are compared. Those within `recent`
    (m) of path are of the same visit.
    """
    poses, ends, end = views.poses, views.ends, min(end, len(views.paths))
    counts, pose = np.zeros((end - first, 2, 2), dtype=np.int64), np.empty(3)
    near, distances = np.empty(options.compared, dtype=np.int64), np.empty(options.compared)
    for k in range(first, end):
        # Of a frozen laser nothing can be compared.
        if ends[k + 1] == ends[k]:
            continue
        for within in range(2):
            n = 0
            for j in range(k):
                is_recent = views.paths[k] - views.paths[j] <= recent
                if is_recent != (within == 1) or ends[j + 1] == ends[j]:
                    continue
                distance = np.hypot(poses[j, 0] - poses[k, 0], poses[j, 1] - poses[k, 1])
                if distance > radius or (n == options.compared and distance >= distances[-1]):
                    continue
                n = min(n + 1, options.compared)
                at = n - 1
                while at > 0 and distances[at - 1] > distance:
                    near[at], distances[at] = near[at - 1], distances[at - 1]
                    at -= 1
                near[at], distances[at] = j, distance
            for j in near[:n]:
                relative_pose(poses[k], poses[j], pose)
                _count_violations(views, options, k, j, pose, counts[k - first, within])
                relative_pose(poses[j], poses[k], pose)
                _count_violations(views, options, j, k, pose, counts[k - first, within])
    return counts


@leaf_kernel
def _count_violations(
    views: VisitViews, options: FreeSpaceOptions, seen: int, by: int, pose: Array, counts: Indices
) -> None:
    """Add to the counts (2,) the points of scan `seen` that scan `by` saw too, and those it looked through.

    `pose` (3,) is that of the first laser relative to the second. Points hidden from the second do not count.
    """
    ranges, first, between = views.ranges[by], views.beams[by, 0], views.beams[by, 1]
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    if between == 0.0:
        return
    for p in range(views.ends[seen], views.ends[seen + 1]):
        x = cos * views.points[p, 0] - sin * views.points[p, 1] + pose[0]
        y = sin * views.points[p, 0] + cos * views.points[p, 1] + pose[1]
        turned = np.arctan2(y, x) - first
        # From the first beam on, whichever way the laser turns.
        turned -= 2 * np.pi * np.floor(turned / (2 * np.pi))
        beam = int(np.floor((turned if between > 0.0 else turned - 2 * np.pi) / between))
        if beam + 1 >= len(ranges) or not (np.isfinite(ranges[beam]) and np.isfinite(ranges[beam + 1])):
            continue
        shortest, longest = np.inf, 0.0
        for b in range(max(beam - 1, 0), min(beam + 3, len(ranges))):
            if np.isfinite(ranges[b]):
                shortest, longest = min(shortest, float(ranges[b])), max(longest, float(ranges[b]))
        distance = np.hypot(x, y)
        tolerance = options.tolerance + options.tolerance_per_metre * distance
        if distance < shortest - tolerance:
            counts[1] += 1
        elif distance <= longest + tolerance:
            counts[0] += 1
