"""The search for the place of a keyframe among those of an earlier visit, without a good start.

The scans around the keyframe are searched together, by branch and bound. The search also tells whether a
joint match may have closed a loop at a wrong place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.graph.model import Loop
from nscan_cli.matching.correlative_search import Search, search
from nscan_cli.matching.likelihood_field import LikelihoodField, likelihood_field
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array, Indices, relative, transform
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatcher, match_at
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.verification import OUTDONE, TOO_LITTLE, verify_place


def find_place(
    route: Route,
    centre: int,
    earlier: Indices,
    window: SearchOptions,
    match: LocalMatcher,
    closing: LoopClosureOptions,
    nscan: NScanOptions,
) -> Place | Loop | None:
    """The place of keyframe `centre` among the `earlier` ones (m,) after verification, or why it is refused.

    None when nothing fits.
    """
    sought = _search_submaps(route, centre, earlier, window, closing)
    if sought is None:
        return None
    scan, field = sought
    about = Search(field, scan, route.poses[centre], window)
    is_far = window.distance > closing.min_distance
    found = about.best(closing.min_score_far if is_far else closing.min_score)
    return (
        None if found is None else verify_place(route, centre, earlier, about, found, match, closing, nscan)
    )


def why_match_doubted(
    route: Route,
    centre: int,
    pose: Array,
    earlier: Indices,
    window: SearchOptions,
    closing: LoopClosureOptions,
    nscan: NScanOptions | None,
) -> str | None:
    """Why keyframe `centre` may lie elsewhere among the `earlier` ones (m,) than at `pose` (3,), or None.

    A joint match ends at the nearest optimum; along a corridor there is one at every door. If the search
    finds another place that fits about as well, a joint match from there, of the same scans, decides by the
    energy of both, which is exact to the centimetre. Without `nscan`, for single matches, the search decides.
    """
    sought = _search_submaps(route, centre, earlier, window, closing)
    if sought is None:
        return TOO_LITTLE
    scan, field = sought
    cells = replace(window, distance=2 * window.cell, turn=closing.agreement_turn)
    here = search(field, scan, pose, closing.min_score, cells)
    if here is None:
        return TOO_LITTLE
    about = Search(field, scan, route.poses[centre], window)
    if about.best(here.score / closing.rival_score) is not None:
        return OUTDONE
    if nscan is None:
        return None
    other = about.best(closing.rival_score * here.score, without=(pose, closing.agreement_distance))
    if other is None:
        return None
    (energy, _), (other_energy, there) = match_at(route, centre, (pose, other.pose), nscan)
    is_elsewhere = np.hypot(*(there - pose)[:2]) > closing.agreement_distance
    return OUTDONE if is_elsewhere and other_energy < energy else None


def _search_submaps(
    route: Route, centre: int, earlier: Indices, window: SearchOptions, closing: LoopClosureOptions
) -> tuple[Array, LikelihoodField] | None:
    """The points (m, 2) around keyframe `centre`, in its frame, and the likelihood field of the `earlier`
    ones (m,).

    None if one of them has no points.
    """
    keyframes, paths, poses = route.keyframes, route.paths, route.poses
    beside = np.flatnonzero(np.abs(paths - paths[centre]) <= closing.scan_path)
    scan = _cloud(keyframes, beside, relative(poses[beside], poses[centre]))
    cloud = _cloud(keyframes, earlier, poses[earlier])
    if not len(scan) or not len(cloud):
        return None
    return scan, likelihood_field(cloud, window)


def _cloud(keyframes: Sequence[Keyframe], chosen: Indices, poses: Array) -> Array:
    """The points (m, 2) of the chosen keyframes (n,), at poses (n, 3)."""
    points = [keyframes[k].points for k in chosen.tolist()]
    cloud = np.concatenate([np.empty((0, 2)), *points])
    counts = np.array([len(each) for each in points], dtype=np.int64)
    return transform(np.repeat(poses, counts, axis=0), cloud)
