"""Verification of loops: tests for a place that a search found.

No other place may fit nearly as well, the scans of both visits must match from there, and enough keyframes
must find the same place. A wrong loop is worse than a missed one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.graph.model import Loop
from nscan_cli.matching.correlative_search import FoundPose, Search
from nscan_cli.poses import Indices, Mask, compose, relative, wrap
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatcher, visit_moved
from nscan_cli.slam.local_matching.neighbours import choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.relative_uncertainty import RelativeSigma

AMBIGUOUS = "another place fits as well"
OUTDONE = "another place fits better"
TOO_LITTLE = "too little of an earlier visit is in view to identify the place"
NO_MATCH = "the scans of both visits do not match"
ELSEWHERE = "the joint match moves away from the place found"
NO_SECOND = "no second keyframe finds the same place"
SO_FAR_OFF = "too few keyframes find the same place, which is farther off than the path drifts"
LOST = "tracking broke since then: the place must be searched"


def verify_place(
    route: Route,
    centre: int,
    earlier: Indices,
    about: Search,
    found: FoundPose,
    match: LocalMatcher,
    closing: LoopClosureOptions,
    nscan: NScanOptions,
) -> Place | Loop:
    """The place `found` of keyframe `centre` if it passes all tests, else the reason why it is refused."""
    keyframes, poses = route.keyframes, route.poses
    nodes = keyframes[int(earlier[0])].row, keyframes[centre].row
    rival = about.best(closing.rival_score * found.score, without=(found.pose, closing.rival_distance))
    if rival is not None:
        return Loop(nodes, False, AMBIGUOUS, found.score)
    moved = visit_moved(route, centre, found.pose, nscan)
    away = np.hypot(*(poses[earlier, :2] - found.pose[:2]).T).min()
    radius = max(nscan.radius, float(away) + nscan.radius)
    wider = replace(nscan, radius=radius)
    for options in (wider, stretches(wider, closing)):
        near = choose_neighbours(moved, route.paths, centre, options)
        local_match = match(route._replace(poses=moved), centre, near, options)
        tie = None if local_match is None else local_match.tie(keyframes[centre].row)
        if tie is not None:
            break
    if local_match is None or tie is None:
        return Loop(nodes, False, NO_MATCH, found.score)
    old = int(np.searchsorted(route.rows, tie[0]))
    off = compose(moved[old], tie[1]) - found.pose
    if np.hypot(off[0], off[1]) > closing.match_reach:
        return Loop(nodes, False, ELSEWHERE, found.score)
    return Place(old, centre, tie[1], options, local_match)


def stretches(options: NScanOptions, closing: LoopClosureOptions) -> NScanOptions:
    """The options with which stretches of the path are matched in place of single scans.

    If a laser looks only ahead, scans of visits in opposite directions see little of the same. A stretch,
    whose scans hang together by their own visit, sees enough.
    """
    return replace(
        options,
        radius=options.radius + closing.stretch_radius,
        max_scans=closing.stretch_scans,
        min_overlap=closing.stretch_overlap,
    )


def places_agree(one: Place, other: Place, route: Route, options: LoopClosureOptions) -> bool:
    """Whether two keyframes, the `other` one later, find the same place."""
    poses, paths = route.poses, route.paths
    off = one.corrected(poses, other.centre) - other.corrected(poses, other.centre)
    within = np.hypot(off[0], off[1]) <= options.agreement_distance
    turned = abs(wrap(off[2])) <= options.agreement_turn
    return bool(within and turned and paths[other.centre] - paths[one.centre] <= options.agreement_path)


def why_too_few(
    agreeing: Sequence[Place], route: Route, sigma: RelativeSigma, options: LoopClosureOptions
) -> str | None:
    """Why the keyframes that agree on a place are too few, or None; `sigma` is that from the last of them.

    A place farther off than the path drifts mostly only looks alike, while the right one has never been seen.
    Places that look alike do so over a short distance only, so scans far apart must agree there.
    """
    place, first = agreeing[-1], agreeing[0]
    lost = bool(is_lost(sigma, options)[place.old])
    off = relative(route.poses[place.centre], route.poses[place.old]) - place.measured
    likely = max(options.drift_sigmas * sigma.distance[place.old], options.slip_distance)
    surprises = not lost and np.hypot(off[0], off[1]) > likely
    if len(agreeing) < (options.min_agreeing_doubtful if lost or surprises else options.min_agreeing):
        return SO_FAR_OFF if surprises else NO_SECOND
    share_scans = route.paths[place.centre] - route.paths[first.centre] < 2 * options.scan_path
    return SO_FAR_OFF if surprises and share_scans else None


def is_lost(sigma: RelativeSigma, options: LoopClosureOptions) -> Mask:
    """(K,) whether not even the direction to a keyframe is known: the track has broken since."""
    return options.sigmas * sigma.angle >= np.pi
