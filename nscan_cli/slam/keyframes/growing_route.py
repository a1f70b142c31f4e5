"""Step 2 of the loop (paper, V): keyframes of tracked scans, and the route of the graph along them."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import relative
from nscan_cli.slam.frontend.tracked_scans import TrackedBatch
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import chain_relations, extended, route_of
from nscan_cli.slam.state import SlamState


def add_keyframes(state: SlamState, batch: TrackedBatch) -> bool:
    """Choose keyframes among tracked scans; returns whether there are any.

    Changes keyframes, chain, tracked, weakest_sigmas and breaks.
    """
    known = len(state.keyframes)
    if batch.starts_segment:
        state.keyframes.end_segment()
    if batch.after_break:
        state.breaks.append(batch.scans.first)
    state.keyframes.select(batch.scans, batch.tracked, batch.starts_segment)
    state.chain += chain_relations(state.keyframes.list[max(known - 1, 0) :], state.options.keyframes)
    state.tracked.append(batch.tracked.poses)
    state.weakest_sigmas.append(batch.tracked.weakest_sigmas)
    return len(state.keyframes) > known


def extend_route(state: SlamState, keyframe: Keyframe) -> None:
    """Let the next keyframe join the graph, with its relation to the one before. Changes route, detector."""
    size = len(state.poses)
    if not size:
        state.route = route_of(state.keyframes.list, state.chain, np.zeros((1, 3)))
        return
    relation, length = state.chain[size - 1], keyframe.tracked.path - float(state.route.paths[-1])
    odometry = None
    if state.odometry is not None:
        odometry = relative(state.odometry[relation.nodes[1]], state.odometry[relation.nodes[0]])
    state.detector.extend(relation, length, odometry)
    state.route = extended(state.route, size + 1)
