"""The SLAM loop (paper, V): from the scans of a log to a pose graph."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nscan_cli.graph.model import Graph
from nscan_cli.slam.backend.contradicting_loops import mend_contradicting_loops
from nscan_cli.slam.backend.contradicting_visits import mend_contradicting_visits
from nscan_cli.slam.backend.final_deskewing import deskew_by_final_path
from nscan_cli.slam.backend.finish import finish_graph
from nscan_cli.slam.backend.loop_rejection import reject_contradicting_loops
from nscan_cli.slam.backend.odometry_over_breaks import believe_odometry_over_breaks
from nscan_cli.slam.backend.optimisation import optimise, optimise_if_due
from nscan_cli.slam.backend.refinement import refine
from nscan_cli.slam.frontend.scan_batch import ScanBatch, scan_batches
from nscan_cli.slam.frontend.segment_tracker import SegmentTracker, tracker_of
from nscan_cli.slam.frontend.tracked_scans import TrackedBatch
from nscan_cli.slam.keyframes.growing_route import add_keyframes, extend_route
from nscan_cli.slam.local_matching.match_keyframe import match_keyframe
from nscan_cli.slam.local_matching.neighbours import choose_neighbours
from nscan_cli.slam.local_matching.speculative_matching import SpeculativeMatching
from nscan_cli.slam.loop_closure.close_loops import close_loops
from nscan_cli.slam.state import SlamState
from nscan_cli.threads import BackgroundCalls

LoopProgress = Callable[[int, int], None]
"""Called with the number of scans tracked and of keyframes."""


def run_slam(state: SlamState, report: LoopProgress) -> Graph:
    """Map a whole log, from its state before the first scan; returns the graph.

    Tracking needs nothing of the graph: with two threads the graph grows beside it. Changes what its steps
    change, tracking_restarts and tracking_searches.
    """
    tracker, behind = tracker_of(state.log, state.options), state.options.nscan.centre_delay
    with (
        SpeculativeMatching(state.match, state.options.nscan, state.threads) as ahead,
        BackgroundCalls(state.threads) as beside,
    ):
        for scans in scan_batches(state.log, state.options.tracking, state.odometry, state.frozen_scans):
            for batch in track(tracker, scans, is_last=scans.first + len(scans) == len(state.log)):
                if add_keyframes(state, batch):
                    # The newest keyframe still collects scans.
                    beside(partial(grow, state, ahead), len(state.keyframes) - 1)
            report(scans.first + len(scans), len(state.keyframes))
        ahead.open()
    state.tracking_restarts, state.tracking_searches = tracker.restarts, tracker.searches
    state.keyframes.end_segment()
    grow(state, ahead, len(state.keyframes))
    for centre in range(len(state.keyframes) - behind, len(state.keyframes)):
        relate(state, ahead, centre)
    optimise(state, state.options.optimisation.final)
    reject_contradicting_loops(state)
    deskew_by_final_path(state)
    refine(state)
    mend_contradicting_visits(state)
    mend_contradicting_loops(state)
    believe_odometry_over_breaks(state)
    return finish_graph(state)


def track(tracker: SegmentTracker, scans: ScanBatch, is_last: bool) -> list[TrackedBatch]:
    """Step 1: match each scan with the map of the last metres; returns the scans that are settled by it."""
    settled = tracker.follow(scans)
    return settled + tracker.finish() if is_last else settled


def grow(state: SlamState, ahead: SpeculativeMatching, size: int) -> None:
    """Let the first `size` keyframes join the graph; relate those that have enough keyframes after them.

    Changes keyframes, route, detector, and what `relate` changes.
    """
    for keyframe in state.keyframes.list[len(state.poses) : size]:
        keyframe.make_ndt()
        extend_route(state, keyframe)
        relate(state, ahead, len(state.poses) - 1 - state.options.nscan.centre_delay)


def relate(state: SlamState, ahead: SpeculativeMatching, centre: int) -> None:
    """Steps 3 to 5 for one keyframe, unless the matches of others cover it: match, close loops, optimise.

    Changes what `match_keyframe`, `close_loops` and `optimise_if_due` change.
    """
    if centre < 0:
        return
    route, options = state.route, state.options.nscan
    neighbours = choose_neighbours(route.poses, route.paths, centre, options)
    if not state.coverage.is_due(route, centre, neighbours, options):
        return
    local_match = match_keyframe(state, ahead, centre, neighbours)
    if local_match is not None:
        optimise_if_due(state)
    close_loops(state, centre, neighbours, local_match)
