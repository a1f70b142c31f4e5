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
from nscan_cli.matching.search import Field, SearchOptions, likelihood_field, search
from nscan_cli.poses import Array, compose, relative, transform
from nscan_cli.slam.keyframes import Route
from nscan_cli.slam.nearby import MatchNearby, Nearby
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
    nearby: Nearby
    """The match of both visits."""

    def corrected(self, poses: Array, keyframe: int) -> Array:
        """(3,) where a keyframe of this visit lies if the place is right, at the graph's poses (K, 3)."""
        here = compose(poses[self.old], self.measured)
        return compose(here, relative(poses[keyframe], poses[self.centre]))


def piece_moved(route: Route, place: Place, breaks: Sequence[int]) -> Route:
    """The route with the piece of the keyframe found moved there, if the track has broken since the place.

    `breaks` are rows of the log, increasing. The graph would find it too, but hardly from half a turn away.
    """
    rows = [keyframe.row for keyframe in route.keyframes]
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
    found = search(field, scan, poses[centre], closing.score, window)
    if found is None:
        return None
    nodes = keyframes[int(earlier[0])].row, keyframes[centre].row
    elsewhere = found.pose, closing.apart
    if search(field, scan, poses[centre], closing.rival * found.score, window, elsewhere) is not None:
        return Loop(nodes, False, AMBIGUOUS, found.score)
    moved, visit = poses.copy(), np.abs(route.paths - route.paths[centre]) <= nscan.recent
    moved[visit] = compose(found.pose, relative(poses[visit], poses[centre]))
    away = np.hypot(*(poses[earlier, :2] - found.pose[:2]).T).min()
    radius = max(nscan.radius, float(away) + nscan.radius)
    nearby = match(route._replace(poses=moved), centre, replace(nscan, radius=radius))
    tie = None if nearby is None else nearby.tie(keyframes[centre].row)
    if nearby is None or tie is None:
        return Loop(nodes, False, NO_MATCH, found.score)
    old = route.rows(range(len(poses))).index(tie[0])
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
) -> str | None:
    """Why keyframe `centre` may lie elsewhere among the `earlier` ones (m,) than at `pose` (3,), or None.

    A joint match ends at the optimum that is next. Along a corridor there is one at every door.
    """
    sought = _sought(route, centre, earlier, window, closing)
    if sought is None:
        return TOO_LITTLE
    scan, field = sought
    cells = replace(window, distance=2 * window.cell, turn=closing.agree_turn)
    here = search(field, scan, pose, closing.score, cells)
    if here is None:
        return TOO_LITTLE
    return (
        None
        if search(field, scan, route.poses[centre], here.score / closing.rival, window) is None
        else OUTDONE
    )


def _sought(
    route: Route,
    centre: int,
    earlier: NDArray[np.int64],
    window: SearchOptions,
    closing: ClosingOptions,
) -> tuple[Array, Field] | None:
    """The points (m, 2) around keyframe `centre`, in its frame, and the field of the `earlier` ones (m,).

    None when one of them has no points.
    """
    keyframes, _, paths, poses = route
    beside = np.flatnonzero(np.abs(paths - paths[centre]) <= closing.beside)
    here = relative(poses[beside], poses[centre])
    scan = [transform(pose, keyframes[k].points) for k, pose in zip(beside.tolist(), here, strict=True)]
    cloud = [transform(poses[k], keyframes[k].points) for k in earlier.tolist()]
    if not any(map(len, scan)) or not any(map(len, cloud)):
        return None
    return np.concatenate(scan), likelihood_field(np.concatenate(cloud), window)
