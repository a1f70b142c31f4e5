"""Closing of large loops where a search finds an earlier visit (paper, V: step 4 of the loop)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.poses import Indices
from nscan_cli.slam.backend.optimisation import optimise
from nscan_cli.slam.keyframes.route import distances_from, is_earlier
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.match_keyframe import add_relations
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.loop_closure.place import Place, move_segment
from nscan_cli.slam.loop_closure.verification import TOO_LITTLE
from nscan_cli.slam.state import SlamState


def close_loops_left_open(state: SlamState) -> list[Place]:
    """Search once more where no loop ties the path to an earlier visit nearby; returns the places found.

    It is called once the graph is optimised. While the graph grew, such a place may have been too far off, or
    not yet seen by a second keyframe. Lets the detector begin again, and changes what `close_loops` changes.
    """
    route, known = state.route, len(state.places)
    related = [row for relation in state.loop_relations() for row in relation.nodes]
    closed = np.isin(route.rows, related)
    # A keyframe between two that are related lies well.
    closed[1:-1] |= closed[:-2] & closed[2:]
    state.detector.begin_again(state.options.loop_closure)
    for centre in np.flatnonzero(~closed).tolist():
        near = choose_neighbours(state.poses, route.paths, centre, state.options.nscan)
        earlier = near.members[near.from_other_visit & (near.members < centre)]
        if len(earlier):
            _search(state, centre, earlier)
    return state.places[known:]


def close_loops_between(state: SlamState, first: int, last: int) -> list[Place]:
    """Search once more for the keyframes in rows `first` to `last`; returns the places found.

    Earlier visits of these places contradict them: each is searched `contradicted_distance` away at least,
    however certain it seems, and is no surprise there. Lets the detector begin again, and changes what
    `close_loops` changes.
    """
    route, known, options = state.route, len(state.places), state.options.loop_closure
    reach = options.contradicted_distance
    again = replace(
        options,
        min_distance=max(reach, options.min_distance),
        slip_distance=max(reach, options.slip_distance),
    )
    state.detector.begin_again(again)
    for centre in np.flatnonzero((route.rows >= first) & (route.rows <= last)).tolist():
        is_near = distances_from(state.route, centre) <= reach
        older = is_earlier(route, centre, state.options.nscan.visit_path)
        _search(state, centre, np.flatnonzero(older & is_near))
    return state.places[known:]


def close_loops(
    state: SlamState, centre: int, neighbours: Neighbours, local_match: LocalMatch | None
) -> None:
    """Search for keyframe `centre` among earlier visits that may be too far off for a joint match.

    Changes detector. If enough keyframes find the same place, changes relations, loops and places, and
    optimises the graph, which changes route and schedule.
    """
    loop = None if local_match is None else local_match.loop
    # At the border of an earlier visit a place well inside fits better than the right one, half of which
    # was not seen: there a search says no more than the match.
    if not state.options.nscan.loops or (loop is not None and loop.reason == TOO_LITTLE):
        return
    is_refused = loop is not None and not loop.accepted
    left_out = neighbours.members[neighbours.from_other_visit & is_refused]
    _search(state, centre, left_out)


def _search(state: SlamState, centre: int, left_out: Indices) -> None:
    places = state.detector.close(state.route, centre, left_out, state.loop_relations)
    if not places:
        return
    state.route = move_segment(state.route, places[-1], state.breaks)
    for place in places:
        add_relations(state, place.local_match)
    state.places.extend(places)
    optimise(state, state.options.optimisation.after_large_loop)
