"""Where one visit looks through what another one saw: what stands still does not let it.

A joint match asks where points meet walls. In a corridor they do 6 m farther on, too, and a map that is wrong
by so much closes its loops without any contradiction between relations. What gives it away are the beams
that end behind a wall: there the other visit stood before a door.

Glass, people and low things are looked through in a sound map, too, in one building more than in another. How
much is usual, the same comparison within a visit tells: there the map is right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.pose_kernels import relative_pose
from nscan_cli.poses import Array, Indices, inverse, transform
from nscan_cli.slam.keyframes.keyframe import Route
from nscan_cli.slam.options import NScanOptions
from nscan_cli.threads import map_in_threads

STRETCH = 40
"""Keyframes that came by again, one after another, are judged together. What differs in a sound map is seen
from few: the worst ten of fr-campus look through 24 % of what was there before, the worst forty 8 %."""
AT_A_TIME = 64
"""Keyframes that a thread compares."""
LEAST_KEYFRAMES = 3
LEAST_POINTS = 50
"""Of a keyframe that counts so many must lie within what earlier visits saw."""
COMPARED = 8
"""Earlier keyframes of other visits that one is compared with, the nearest, and of its own."""
TIMES, MORE = 2.5, 0.01
"""A sound map explains so many times what is looked through within a visit, and so much more. In real
buildings it is 0.5 to 1.6 times as much, without odometry too; in simulated maps that are metres wrong, 4 to
300 times;"""
MOST = 0.15
"""and no more than this. It is 8 % in mit-killian and fr-campus; in maps of these that are metres wrong, 26 %
and more."""
APART = 0.2
"""A point lies clearly before what was measured there with so much (m),"""
APART_PER_METRE = 0.02
"""and so much more for each metre of its range; of four neighbouring beams the shortest counts."""


class FreeSpaceViolation(NamedTuple):
    """The stretch of the path whose keyframes contradict earlier visits most."""

    share: float
    """Of the points that the other visit has in view, as many were looked through."""
    within: float
    """The greatest such share of a stretch within visits; nan where too little was compared."""
    first: int
    """Rows of the first keyframe of the stretch and of its last."""
    last: int

    @property
    def most(self) -> float:
        """The greatest share that a sound map explains."""
        return MOST if np.isnan(self.within) else min(TIMES * self.within + MORE, MOST)


class VisitViews(NamedTuple):
    """What K scans saw, and from where."""

    poses: Array
    """(K, 3) of the laser."""
    paths: Array
    """(K,) m"""
    points: Array
    """(P, 2) one scan after another, each in the laser's frame."""
    ends: Indices
    """(K + 1,) scan k has points[ends[k] : ends[k + 1]]."""
    ranges: NDArray[np.float32]
    """(K, B) m; what is not finite tells nothing."""
    beams: Array
    """(K, 2) direction of the first beam, and from one to the next, rad."""


def free_space_violations(
    log: LaserLog, route: Route, options: NScanOptions, threads: int = 1
) -> FreeSpaceViolation | None:
    """The worst stretch of the route's K keyframes where it is; None where no place was seen again.

    Those within the radius that are another visit are compared, as for joint matches.
    """
    rows = route.rows
    if not len(rows) or log.ranges.shape[1] < 2:
        return None
    to_laser = inverse(log.mount)
    points = [transform(to_laser, keyframe.points) for keyframe in route.keyframes[: len(route.poses)]]
    views = VisitViews(
        log.laser_pose(route.poses),
        route.paths,
        np.concatenate(points),
        np.cumsum([0, *map(len, points)]),
        log.ranges[rows],
        np.stack([log.angle_min[rows], log.angle_increment[rows]], axis=1),
    )
    parts = map_in_threads(
        threads,
        lambda first: _compare(views, first, first + AT_A_TIME, options.radius, options.recent),
        range(0, len(rows), AT_A_TIME),
    )
    counts = np.concatenate(parts)
    again = np.flatnonzero(counts[:, 0].sum(axis=1) >= LEAST_POINTS)
    if len(again) < LEAST_KEYFRAMES:
        return None
    size = min(STRETCH, len(again))
    sums = np.cumsum(np.concatenate([np.zeros((1, 2, 2), dtype=np.int64), counts[again]]), axis=0)
    compared = sums[size:] - sums[:-size]
    others, within = compared[:, 0], compared[compared[:, 1].sum(axis=1) >= LEAST_POINTS, 1]
    shares = others[:, 1] / others.sum(axis=1)
    worst = int(np.argmax(shares))
    first, last = rows[again[[worst, worst + size - 1]]].tolist()
    usual = float((within[:, 1] / within.sum(axis=1)).max()) if len(within) else np.nan
    return FreeSpaceViolation(float(shares[worst]), usual, first, last)


@kernel
def _compare(views: VisitViews, first: int, end: int, radius: float, recent: float) -> NDArray[np.int64]:
    """What keyframes `first` to `end` and earlier ones see of each other: (k, 2, 2) points.

    First with those of other visits, more than `recent` (m) of path back, then with those of the same one:
    how many are where the other saw them, and how many it looked through. Compared are the nearest of each
    within the radius (m).
    """
    poses, ends, end = views.poses, views.ends, min(end, len(views.paths))
    counts, pose = np.zeros((end - first, 2, 2), dtype=np.int64), np.empty(3)
    near, distances = np.empty(end, dtype=np.int64), np.empty(end)
    for k in range(first, end):
        # A laser that hangs saw nothing that could be compared.
        if ends[k + 1] == ends[k]:
            continue
        for within in range(2):
            n = 0
            for j in range(k):
                is_recent = views.paths[k] - views.paths[j] <= recent
                if is_recent != (within == 1) or ends[j + 1] == ends[j]:
                    continue
                distance = np.hypot(poses[j, 0] - poses[k, 0], poses[j, 1] - poses[k, 1])
                if distance <= radius:
                    near[n], distances[n] = j, distance
                    n += 1
            order = np.argsort(distances[:n], kind="mergesort")
            for at in order[:COMPARED]:
                j = near[at]
                relative_pose(poses[k], poses[j], pose)
                _count(views, k, j, pose, counts[k - first, within])
                relative_pose(poses[j], poses[k], pose)
                _count(views, j, k, pose, counts[k - first, within])
    return counts


@leaf_kernel
def _count(views: VisitViews, seen: int, by: int, pose: Array, counts: NDArray[np.int64]) -> None:
    """Add how many points of the scan `seen`, at a pose (3,) relative to the laser of another, that one saw
    where they are, and how many it looked through. What is hidden from it does not count."""
    ranges, first, between = views.ranges[by], views.beams[by, 0], views.beams[by, 1]
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    if between == 0.0:
        return
    for p in range(views.ends[seen], views.ends[seen + 1]):
        x = cos * views.points[p, 0] - sin * views.points[p, 1] + pose[0]
        y = sin * views.points[p, 0] + cos * views.points[p, 1] + pose[1]
        turned = np.arctan2(y, x) - first
        # Counted on from the first beam, whichever way the laser turns.
        turned -= 2 * np.pi * np.floor(turned / (2 * np.pi))
        beam = int(np.floor((turned if between > 0.0 else turned - 2 * np.pi) / between))
        if beam + 1 >= len(ranges) or not (np.isfinite(ranges[beam]) and np.isfinite(ranges[beam + 1])):
            continue
        shortest, longest = np.inf, 0.0
        for b in range(max(beam - 1, 0), min(beam + 3, len(ranges))):
            if np.isfinite(ranges[b]):
                shortest, longest = min(shortest, float(ranges[b])), max(longest, float(ranges[b]))
        distance = np.hypot(x, y)
        apart = APART + APART_PER_METRE * distance
        if distance < shortest - apart:
            counts[1] += 1
        elif distance <= longest + apart:
            counts[0] += 1
