"""A saved graph is refined again: steps 5 and 6 of the loop (paper, V), without tracking.

The keyframes are made anew from the scans, at the poses of the graph.
"""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any, get_args

import numpy as np

from nscan_cli.files.provenance import option_fields
from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.matching.motion_model import odometry_prior
from nscan_cli.poses import Indices, relative
from nscan_cli.slam.backend.final_deskewing import add_keyframes_at, tracked_at
from nscan_cli.slam.backend.finish import finish_graph
from nscan_cli.slam.backend.guessed_steps import guesses_of
from nscan_cli.slam.backend.loop_rejection import reject_contradicting_loops
from nscan_cli.slam.backend.odometry_over_breaks import believe_odometry_over_breaks
from nscan_cli.slam.backend.refinement import refine
from nscan_cli.slam.keyframes.route import route_of
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.verification import (
    AMBIGUOUS,
    ELSEWHERE,
    NO_MATCH,
    NO_SECOND,
    SO_FAR_OFF,
    stretches,
)
from nscan_cli.slam.options import Relations, SlamOptions
from nscan_cli.slam.state import SlamState

MIN_PARAMETER, MAX_PARAMETER, MAX_LIST_LENGTH = 1e-9, 1e9, 10
"""Bounds of a parameter of a saved graph, and of the length of a list of them."""
SEARCH_VERDICTS = (AMBIGUOUS, ELSEWHERE, NO_MATCH, NO_SECOND, SO_FAR_OFF)
"""Verdicts of the search for large loops. They stay, as the search is not made again."""


def can_refine(graph: Graph) -> bool:
    """Whether slam made the graph: its parameters are there, and all scans go with the last keyframe."""
    keyframes = graph.keyframes
    if "slam" not in graph.provenance.get("parameters", {}) or keyframes[0] != 0:
        return False
    last = keyframes[np.searchsorted(keyframes, np.arange(len(graph)), side="right") - 1]
    return bool(np.array_equal(graph.anchors, last))


def options_of(graph: Graph) -> SlamOptions:
    """The parameters that the graph was made with; what it does not say has its default.

    Raises ValueError naming a parameter that none can have been made with.
    """
    options: SlamOptions = _restored_options(SlamOptions(), graph.provenance["parameters"]["slam"], "slam")
    return options


def resume(graph: Graph, log: LaserLog, rows: Indices, threads: int = 1) -> Graph:
    """The graph after its loops are tested, and its matches made again from its poses.

    `rows` (N,) are the rows of the log with the scans of the nodes. `can_refine` has to hold.
    """
    log = log if np.array_equal(rows, np.arange(len(log))) else excerpt(log, rows)
    state = state_of_graph(graph, log, options_of(graph), threads)
    reject_contradicting_loops(state)
    refine(state, search=False)
    believe_odometry_over_breaks(state)
    refined = finish_graph(state)
    refined.loops += [loop for loop in graph.loops if loop.reason in SEARCH_VERDICTS]
    refined.provenance = graph.provenance
    return refined


def state_of_graph(graph: Graph, log: LaserLog, options: SlamOptions, threads: int = 1) -> SlamState:
    """The state of the loop after its last optimisation, as a saved graph of all scans of `log` has it."""
    state, breaks = SlamState.of_log(log, options, threads), _breaks(graph, options)
    state.log = log.moving_along(graph.poses)
    found = tracked_at(graph.poses, breaks, options)
    add_keyframes_at(state, found, graph.anchors == np.arange(len(log)), breaks)
    chain = _chain_of_graph(graph, options)
    in_chain = {id(relation) for relation in chain}
    matched = [pair for pair in graph.pairwise if id(pair) not in in_chain]
    return dataclasses.replace(
        state,
        route=route_of(state.keyframes.list, chain, graph.poses[graph.keyframes]),
        chain=chain,
        tracked=[graph.poses],
        breaks=sorted(breaks),
        matched_pairs=[pair for pair in matched if pair.origin != "odometry"],
        odometry_relations=[pair for pair in matched if pair.origin == "odometry"],
        nscan_relations=list(graph.nscan),
        other_relations=list(graph.others),
        saved_relations=[*graph.pairwise, *graph.nscan],
        saved_guesses=guesses_of(graph),
        loops=[loop for loop in graph.loops if loop.reason not in SEARCH_VERDICTS],
        places=_large_loop_places(graph, options),
    )


def _breaks(graph: Graph, options: SlamOptions) -> set[int]:
    """The keyframes before which the track broke: the relation to them says nothing of the turn."""
    least = (options.breaks.turn_sigma / 2) ** -2
    tracked = [pair for pair in graph.pairwise if pair.origin == "track"]
    return {pair.nodes[1] for pair in tracked if pair.information[2, 2] <= least}


def _chain_of_graph(graph: Graph, options: SlamOptions) -> list[Pairwise]:
    """The relations from each keyframe to the next.

    A graph of nScan relations alone lacks those that nScan relations replace. They are replaced by what
    odometry would say of such a step.
    """
    tracked: dict[tuple[int, int], Pairwise] = {}
    for pair in graph.pairwise:
        if pair.origin == "track":
            tracked.setdefault(pair.nodes, pair)
    chain = []
    for a, b in itertools.pairwise(graph.keyframes.tolist()):
        step, information = odometry_prior(graph.poses[a], graph.poses[b], options.tracking.scan.odometry)
        chain.append(tracked.get((a, b)) or Pairwise((a, b), step, information, "track"))
    return chain


def _large_loop_places(graph: Graph, options: SlamOptions) -> list[Place]:
    """The large loops: those with scans farther apart than the radius of a joint match."""
    position = {int(node): k for k, node in enumerate(graph.keyframes)}
    loops: list[tuple[tuple[int, ...], int, LocalMatch]] = []
    for joint in graph.nscan:
        if joint.origin == "loop":
            loops.append((joint.nodes, joint.nodes[joint.fixed], LocalMatch((), joint, None, 0.0, True)))
    for pair in graph.pairwise:
        if pair.origin == "loop":
            loops.append((pair.nodes, pair.nodes[1], LocalMatch((pair,), None, None, 0.0, True)))
    places = []
    for nodes, centre, local_match in loops:
        away = relative(graph.poses[list(nodes)], graph.poses[centre])
        distances = np.hypot(away[:, 0], away[:, 1])
        farthest = nodes[int(np.argmax(distances))]
        if distances.max() > options.nscan.radius:
            measured = relative(graph.poses[centre], graph.poses[farthest])
            radius = float(distances.max()) + options.refinement.min_motion
            matched = dataclasses.replace(options.nscan, radius=radius)
            if len(nodes) > options.nscan.max_scans:
                matched = dataclasses.replace(stretches(matched, options.loop_closure), radius=radius)
            places.append(Place(position[farthest], position[centre], measured, matched, local_match))
    return places


def _restored_options(default: Any, values: Any, place: str) -> Any:
    """The options `default` with the values of a JSON object, as far as it has such fields."""
    if not isinstance(values, dict):
        raise ValueError(f"{place} is no object")
    fields = option_fields(default) or {}
    given = {
        name: _checked_value(usual, values[name], f"{place}.{name}")
        for name, usual in fields.items()
        if name in values
    }
    return type(default)(**fields | given)


def _checked_value(usual: Any, value: Any, place: str) -> Any:
    """A value of the JSON, if it is of the type of the usual one and within bounds. Raises ValueError."""
    if option_fields(usual) is not None:
        return _restored_options(usual, value, place)
    if isinstance(usual, tuple):
        if not isinstance(value, (list, tuple)) or not 0 < len(value) <= MAX_LIST_LENGTH:
            raise ValueError(f"{place} is no list of a few values")
        return tuple(_checked_value(usual[0], part, place) for part in value)
    if isinstance(usual, (bool, str)) or usual is None:
        if type(value) is type(usual) and (not isinstance(usual, str) or value in get_args(Relations)):
            return value
    elif type(value) is int or (type(value) is float and isinstance(usual, float)):
        # Nothing that is measured by a parameter is below 0, and where 0 is none, it would divide. Only
        # what counts from a middle has both signs.
        least = 0 if isinstance(usual, int) or usual == 0 else MIN_PARAMETER
        least = -MAX_PARAMETER if usual < 0 else least
        if least <= value <= MAX_PARAMETER:
            return value
    raise ValueError(f"{place} is {str(value)[:40]!r}, which no graph is made with")
