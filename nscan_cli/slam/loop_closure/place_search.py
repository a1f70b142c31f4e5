"""Where a keyframe lies among those of an earlier visit, found without a good start, and verified.

The scans around the keyframe are searched together, by branch and bound, among those of the earlier visit.
What is found must stand alone: no other place may fit nearly as well. And the scans of both visits must
match from there. A wrong loop is worse than a missed one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Loop
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.correlative_search import (
    LikelihoodField,
    Search,
    SearchOptions,
    likelihood_field,
    search,
)
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, MatchNearby, match_at, visit_moved
from nscan_cli.slam.local_matching.neighbours import choose_neighbours
from nscan_cli.slam.options import ClosingOptions, NScanOptions

AMBIGUOUS = "another place fits as well"
OUTDONE = "another place fits better"
TOO_LITTLE = "too little of an earlier visit is seen to tell the place"
NO_MATCH = "the scans of both visits do not match"
ELSEWHERE = "the match leads away from the place found"


@dataclass(frozen=True)
class Place:
    """A keyframe found at a place seen before."""

    old: int
    """A keyframe of the earlier visit."""
    centre: int
    """The keyframe that was found."""
    measured: Array
    """(3,) pose of the centre in the frame of the old."""
    radius: float
    """How near the centre (m) those of the earlier visit were taken from."""
    nearby: LocalMatch
    """The match of both visits."""

    def corrected(self, poses: Array, keyframe: int) -> Array:
        """(3,) where a keyframe of this visit lies if the place is right, at the graph's poses (K, 3)."""
        here = compose(poses[self.old], self.measured)
        return compose(here, relative(poses[keyframe], poses[self.centre]))


def piece_moved(route: Route, place: Place, breaks: Sequence[int]) -> Route:
    """The route with the piece of the keyframe found moved there, if the track has broken since the place.

    `breaks` are rows of the log, increasing. The graph would find it too, but hardly from half a turn away.
    """
    rows = route.rows.tolist()
    begins = [row for row in breaks if rows[place.old] < row <= rows[place.centre]]
    if not begins:
        return route
    first, poses = rows.index(begins[-1]), route.poses.copy()
    for keyframe in range(first, len(poses)):
        poses[keyframe] = place.corrected(route.poses, keyframe)
    return route._replace(poses=poses)


def find_place(
    route: Route,
    centre: int,
    earlier: NDArray[np.int64],
    window: SearchOptions,
    match: MatchNearby,
    closing: ClosingOptions,
    nscan: NScanOptions,
) -> Place | Loop | None:
    """The place of keyframe `centre` among the `earlier` ones (m,), or why what was found is refused.

    None when nothing fits.
    """
    sought = _sought(route, centre, earlier, window, closing)
    if sought is None:
        return None
    scan, field = sought
    keyframes, poses = route.keyframes, route.poses
    about = Search(field, scan, poses[centre], window)
    found = about.best(closing.score)
    if found is None:
        return None
    nodes = keyframes[int(earlier[0])].row, keyframes[centre].row
    if about.best(closing.rival * found.score, without=(found.pose, closing.apart)) is not None:
        return Loop(nodes, False, AMBIGUOUS, found.score)
    moved = visit_moved(route, centre, found.pose, nscan)
    away = np.hypot(*(poses[earlier, :2] - found.pose[:2]).T).min()
    radius = max(nscan.radius, float(away) + nscan.radius)
    wider = replace(nscan, radius=radius)
    near = choose_neighbours(moved, route.paths, centre, wider)
    nearby = match(route._replace(poses=moved), centre, near, wider)
    tie = None if nearby is None else nearby.tie(keyframes[centre].row)
    if nearby is None or tie is None:
        return Loop(nodes, False, NO_MATCH, found.score)
    old = int(np.searchsorted(route.rows, tie[0]))
    off = compose(moved[old], tie[1]) - found.pose
    if np.hypot(off[0], off[1]) > closing.settled:
        return Loop(nodes, False, ELSEWHERE, found.score)
    return Place(old, centre, tie[1], radius, nearby)


def why_doubted(
    route: Route,
    centre: int,
    pose: Array,
    earlier: NDArray[np.int64],
    window: SearchOptions,
    closing: ClosingOptions,
    nscan: NScanOptions | None,
) -> str | None:
    """Why keyframe `centre` may lie elsewhere among the `earlier` ones (m,) than at `pose` (3,), or None.

    A joint match ends at the optimum that is next. Along a corridor there is one at every door. Where the
    search finds another place that fits about as well, a joint match from there, of the same scans, decides:
    by the energy both ways, and exact to the centimetre, where the search has points in cells. Without
    `nscan`, for single matches, the search has the last word.
    """
    sought = _sought(route, centre, earlier, window, closing)
    if sought is None:
        return TOO_LITTLE
    scan, field = sought
    cells = replace(window, distance=2 * window.cell, turn=closing.agree_turn)
    here = search(field, scan, pose, closing.score, cells)
    if here is None:
        return TOO_LITTLE
    about = Search(field, scan, route.poses[centre], window)
    if about.best(here.score / closing.rival) is not None:
        return OUTDONE
    if nscan is None:
        return None
    other = about.best(closing.rival * here.score, without=(pose, closing.agree))
    if other is None:
        return None
    (energy, _), (other_energy, there) = match_at(route, centre, (pose, other.pose), nscan)
    is_elsewhere = np.hypot(*(there - pose)[:2]) > closing.agree
    return OUTDONE if is_elsewhere and other_energy < energy else None


def _sought(
    route: Route,
    centre: int,
    earlier: NDArray[np.int64],
    window: SearchOptions,
    closing: ClosingOptions,
) -> tuple[Array, LikelihoodField] | None:
    """The points (m, 2) around keyframe `centre`, in its frame, and the field of the `earlier` ones (m,).

    None when one of them has no points.
    """
    keyframes, paths, poses = route.keyframes, route.paths, route.poses
    beside = np.flatnonzero(np.abs(paths - paths[centre]) <= closing.beside)
    scan = _cloud(keyframes, beside, relative(poses[beside], poses[centre]))
    cloud = _cloud(keyframes, earlier, poses[earlier])
    if not len(scan) or not len(cloud):
        return None
    return scan, likelihood_field(cloud, window)


def _cloud(keyframes: Sequence[Keyframe], chosen: NDArray[np.int64], poses: Array) -> Array:
    """The points (m, 2) of the keyframes chosen (n,), at poses (n, 3)."""
    points = [keyframes[k].points for k in chosen.tolist()]
    cloud = np.concatenate([np.empty((0, 2)), *points])
    _place(poses, np.array([len(each) for each in points], dtype=np.int64), cloud)
    return cloud


@kernel
def _place(poses: Array, counts: NDArray[np.int64], points: Array) -> None:
    """Transform the points (m, 2), in place: so many (n,) by each of the poses (n, 3), eq. (1)."""
    end = 0
    for k in range(len(poses)):
        cos, sin = np.cos(poses[k, 2]), np.sin(poses[k, 2])
        start, end = end, end + counts[k]
        for p in range(start, end):
            x, y = points[p, 0], points[p, 1]
            points[p, 0] = cos * x - sin * y + poses[k, 0]
            points[p, 1] = sin * x + cos * y + poses[k, 1]
