"""Matching of a keyframe and adding of its relations to the graph (paper, V: step 3 of the loop)."""

from __future__ import annotations

import dataclasses

from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.local_matching.speculative_matching import SpeculativeMatching
from nscan_cli.slam.state import SlamState


def match_keyframe(
    state: SlamState, ahead: SpeculativeMatching, centre: int, neighbours: Neighbours
) -> LocalMatch | None:
    """Match keyframe `centre` with its neighbours, without other visits if its loop is doubted.

    Changes detector, coverage, relations, loops, schedule; begins matches of the next keyframes ahead.
    """
    route = state.route
    # The newest keyframe may still collect scans.
    ahead.begin(route, len(state.keyframes) - 1, centre, neighbours, state.coverage)
    local_match = _verified(state, centre, ahead.match(route, centre, neighbours))
    members = route.rows[neighbours.members].tolist()
    state.coverage.add(int(route.rows[centre]), members, local_match)
    if local_match is not None:
        add_relations(state, local_match)
    return local_match


def add_relations(state: SlamState, local_match: LocalMatch) -> None:
    """Let the relations and the verdict of a match join the graph. Changes relations, loops, schedule."""
    if local_match.loop is not None:
        state.loops.append(local_match.loop)
    state.matched_pairs.extend(local_match.pairwise)
    if local_match.nscan is not None:
        state.nscan_relations.append(local_match.nscan)
    state.schedule.matched(local_match.moved)


def _verified(state: SlamState, centre: int, local_match: LocalMatch | None) -> LocalMatch | None:
    """The match. If its loop is doubted, a match without other visits, and the loop refused."""
    if local_match is None or local_match.loop is None:
        return local_match
    reason = state.detector.why_doubted(state.route, centre, local_match, state.loop_relations)
    if reason is None:
        return local_match
    refused = dataclasses.replace(local_match.loop, accepted=False, reason=reason)
    this_visit = dataclasses.replace(state.options.nscan, loops=False)
    neighbours = choose_neighbours(state.poses, state.route.paths, centre, this_visit)
    alone = state.match(state.route, centre, neighbours, this_visit)
    return None if alone is None else dataclasses.replace(alone, loop=refused, whole=False)
