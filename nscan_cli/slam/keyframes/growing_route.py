"""Step 2 of the loop (paper, V): keyframes of tracked scans, and the route of the graph along them."""

from __future__ import annotations

import numpy as np

from nscan_cli.slam.frontend.track_segments import TrackedSegments
from nscan_cli.slam.keyframes.keyframe import Keyframe, extended, relations_along, route_of
from nscan_cli.slam.state import SlamState


def add_keyframes(state: SlamState, segments: TrackedSegments) -> bool:
    """Choose keyframes among tracked scans; returns whether there are any.

    Changes keyframes, chain, tracked and breaks.
    """
    known = len(state.keyframes)
    if segments.begins:
        state.keyframes.part()
    if segments.breaks:
        state.breaks.append(segments.sensed.first)
    state.keyframes.take(segments.sensed, segments.found, segments.begins)
    state.chain += relations_along(state.keyframes.list[max(known - 1, 0) :], state.options.keyframes)
    state.tracked.append(segments.found.poses)
    return len(state.keyframes) > known


def extend_route(state: SlamState, keyframe: Keyframe) -> None:
    """Let the next keyframe join the graph, with its relation to the one before. Changes route, detector."""
    size = len(state.poses)
    if not size:
        state.route = route_of(state.keyframes.list, state.chain, np.zeros((1, 3)))
        return
    state.detector.extend(state.chain[size - 1], keyframe.tracked.path - float(state.route.paths[-1]))
    state.route = extended(state.route, size + 1)
