"""A place of an earlier visit at which a keyframe was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.options import NScanOptions


@dataclass(frozen=True)
class Place:
    """A keyframe that was found at a place seen before."""

    old: int
    """A keyframe of the earlier visit."""
    centre: int
    """The keyframe that was found."""
    measured: Array
    """(3,) pose of the centre in the frame of the old."""
    options: NScanOptions
    """How both visits were matched: those that see little of the same, in stretches of the path."""
    local_match: LocalMatch
    """The match of both visits."""

    def corrected(self, poses: Array, keyframe: int) -> Array:
        """(3,) pose of the centre if the place is right, at the graph's poses (K, 3)."""
        here = compose(poses[self.old], self.measured)
        return compose(here, relative(poses[keyframe], poses[self.centre]))


def move_segment(route: Route, place: Place, breaks: Sequence[int]) -> Route:
    """The route with the segment of the found keyframe moved to the place, if the track has broken in
    between.

    `breaks` are rows of the log, increasing. Optimisation would hardly find it from half a turn away.
    """
    rows = route.rows.tolist()
    begins = [row for row in breaks if rows[place.old] < row <= rows[place.centre]]
    if not begins:
        return route
    first, poses = rows.index(begins[-1]), route.poses.copy()
    for keyframe in range(first, len(poses)):
        poses[keyframe] = place.corrected(route.poses, keyframe)
    return route._replace(poses=poses)
