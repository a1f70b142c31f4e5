"""The SLAM loop (paper, V): from the scans of a log to a pose graph."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator

import numpy as np

from nscan_cli.graph.marginal_covariances import marginal_covariances
from nscan_cli.graph.model import Graph, Loop, NScan, Pairwise
from nscan_cli.graph.optimise.graph_solver import optimise
from nscan_cli.graph.optimise.robust import contradicting
from nscan_cli.graph.relations.base import Relation
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.backend.energy_cache import Energies
from nscan_cli.slam.backend.refinement import Refinement
from nscan_cli.slam.backend.scan_poses import between_keyframes
from nscan_cli.slam.backend.schedule import OptimisationSchedule
from nscan_cli.slam.backend.subgraph import Subgraph
from nscan_cli.slam.frontend.odometry_checks import believed_odometry, hanging
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.track_segments import SegmentTracker, TrackedSegments
from nscan_cli.slam.frontend.visible_points import sight
from nscan_cli.slam.keyframes.keyframe import Keyframe, Keyframes, extended, relations_along, route_of
from nscan_cli.slam.local_matching.coverage import Coverage
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, MatchNearby, match_neighbours
from nscan_cli.slam.local_matching.match_ahead import Ahead
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.local_matching.pairwise_relations import match_neighbours_pairwise
from nscan_cli.slam.loop_closure.loop_detector import LoopDetector
from nscan_cli.slam.loop_closure.place_search import TOO_LITTLE, Place, piece_moved
from nscan_cli.slam.options import SlamOptions
from nscan_cli.threads import Beside

CONTRADICTS = "contradicts the rest of the graph"

STRETCH = 128
"""Scans that are tracked together, before the keyframes among them are looked for."""

Report = Callable[[int, int], None]
"""Called with the scans and keyframes done."""


class Slam:
    """The state of the loop: what was tracked, the keyframes, their relations and their poses.

    Tracking needs nothing of the graph, so that with two `threads` the graph grows beside it.
    """

    def __init__(self, log: LaserLog, options: SlamOptions, threads: int = 1) -> None:
        self.log, self.options, self.threads = log, options, threads
        seen, cell = log.ranges[log.ranges < options.tracking.max_range], options.tracking.gaussians.cell
        self.tracker = SegmentTracker(
            options.tracking, options.breaks, log.odometry is not None, sight(seen, cell)
        )
        self.odometry, self.jumps = log.odometry, np.zeros(0, dtype=np.int64)
        if log.odometry is not None:
            self.odometry, self.jumps = believed_odometry(log.odometry, log.times)
        self.hanging = hanging(log, self.odometry)
        median_range = float(np.median(seen)) if len(seen) else 0.0
        self.keyframes = Keyframes(options.keyframes, options.nscan.gaussians, median_range)
        self.tracked: list[Array] = []
        self.breaks: list[int] = []
        self.match: MatchNearby = (
            match_neighbours_pairwise if options.relations == "pairwise" else match_neighbours
        )
        self.ahead = Ahead(self.match, options.nscan, threads)
        self.steps: list[Pairwise] = []
        self.route = route_of(self.keyframes.list, self.steps, np.zeros((0, 3)))
        self.pairs: list[Pairwise] = []
        self.nscan: list[NScan] = []
        self.others: list[Relation] = []
        self.loops: list[Loop] = []
        self.energies, self.covered = Energies(len(log)), Coverage()
        self.closing = LoopDetector(options.closing, options.nscan, self.match, self.energies)
        self.places: list[Place] = []
        self.growth = OptimisationSchedule(options.growth)

    def run(self, report: Report) -> Graph:
        """The paper's loop over all scans, and the last optimisation."""
        with self.ahead, Beside(self.threads) as beside:
            for scans in self.stretches():
                for followed in self.track(scans):
                    if self.settle(followed):
                        beside(self.grow, len(self.keyframes) - 1)
                report(scans.first + len(scans), len(self.keyframes))
            self.ahead.open()
        self.keyframes.part()
        self.grow(len(self.keyframes))
        for centre in range(len(self.keyframes) - self.options.nscan.behind, len(self.keyframes)):
            self.match_neighbours(centre)
        self.optimise(max_iterations=100, tolerance=1e-6)
        self.reject()
        self.refine()
        self.energies.forget()
        graph = self.graph()
        graph.marginals = marginal_covariances(graph)
        return graph

    def stretches(self) -> Iterator[ScanBatch]:
        """The scans, a stretch of them at a time: the points that are matched.

        Those are within reach, and none of a laser that hangs.
        """
        first = 0
        for points, ends in self.log.stretches(STRETCH, self.options.tracking.max_range):
            end = first + len(ends) - 1
            hangs = np.isin(np.arange(first, end), self.hanging)
            if hangs.any():
                sizes = np.diff(ends)
                points = points[np.repeat(~hangs, sizes)]
                ends = np.concatenate([[0], np.cumsum(np.where(hangs, 0, sizes))])
            yield ScanBatch(first, points, ends, None if self.odometry is None else self.odometry[first:end])
            first = end

    def track(self, scans: ScanBatch) -> list[TrackedSegments]:
        """Step 1: the poses of the next scans, each by matching it with the map of the last metres.

        Returns the scans that are settled by it; with the last one these are all.
        """
        settled = self.tracker.follow(scans)
        is_last = scans.first + len(scans) == len(self.log)
        return settled + self.tracker.finish() if is_last else settled

    def settle(self, scans: TrackedSegments) -> bool:
        """Step 2: whether there are new keyframes among scans that were tracked."""
        first, known = scans.sensed.first, len(self.keyframes)
        if scans.begins:
            self.keyframes.part()
        if scans.breaks:
            self.breaks.append(first)
        self.keyframes.take(scans.sensed, scans.found, scans.begins)
        self.steps += relations_along(self.keyframes.list[max(known - 1, 0) :], self.options.keyframes)
        self.tracked.append(scans.found.poses)
        return len(self.keyframes) > known

    def grow(self, size: int) -> None:
        """The graph takes in the first `size` keyframes, which are whole, and matches what is due."""
        for keyframe in self.keyframes.list[len(self.poses) : size]:
            keyframe.finish()
            self.add_keyframe(keyframe)
            self.match_neighbours(len(self.poses) - 1 - self.options.nscan.behind)

    def add_keyframe(self, keyframe: Keyframe) -> None:
        """Step 2: a new keyframe, with its relation to the one before."""
        before, path = len(self.poses), keyframe.tracked.path
        if not before:
            self.route = route_of(self.keyframes.list, self.steps, np.zeros((1, 3)))
            return
        self.closing.extend(self.steps[before - 1], path - float(self.route.paths[-1]))
        self.route = extended(self.route, before + 1)

    def match_neighbours(self, centre: int) -> None:
        """Step 3: a keyframe matched with those near it; the graph follows when it must."""
        if centre < 0:
            return
        route, options = self.route, self.options.nscan
        near = choose_neighbours(route.poses, route.paths, centre, options)
        if not self.covered.is_due(route, centre, near, options):
            return
        # One more may be there that is not whole.
        self.ahead.begin(route, len(self.keyframes) - 1, centre, near, self.covered)
        nearby = self.match_unless_doubted(centre, near)
        self.covered.add(int(route.rows[centre]), route.rows[near.tried].tolist(), nearby)
        if nearby is not None:
            self.take(nearby)
            if self.growth.is_due(len(self.poses)):
                due = self.growth.due(self.route, self.relations)
                self.optimise(max_iterations=10, tolerance=1e-3, part=due)
        loop = None if nearby is None else nearby.loop
        # At the border of an earlier visit a place well inside fits better than the right one, half of which
        # was not seen: there a search says no more than the match.
        if options.loops and not (loop is not None and loop.reason == TOO_LITTLE):
            refused = loop is not None and not loop.accepted
            self.close_loops(centre, near.tried[near.seen_before & refused])

    def match_unless_doubted(self, centre: int, near: Neighbours) -> LocalMatch | None:
        """The match of a keyframe with those near it; without other visits if its place there is doubted."""
        nearby = self.ahead.match(self.route, centre, near)
        if nearby is None or nearby.loop is None:
            return nearby
        reason = self.closing.why_doubted(self.route, centre, nearby, self.closed)
        if reason is None:
            return nearby
        loop = dataclasses.replace(nearby.loop, accepted=False, reason=reason)
        alone = dataclasses.replace(self.options.nscan, loops=False)
        near = choose_neighbours(self.route.poses, self.route.paths, centre, alone)
        nearby = self.match(self.route, centre, near, alone)
        return None if nearby is None else dataclasses.replace(nearby, loop=loop, whole=False)

    def close_loops(self, centre: int, left_out: Indices) -> None:
        """Step 4: a keyframe searched where its place may be farther off than a joint match finds it."""
        places = self.closing.close(self.route, centre, left_out, self.closed)
        if not places:
            return
        self.route = piece_moved(self.route, places[-1], self.breaks)
        for place in places:
            self.take(place.nearby)
        self.places.extend(places)
        self.optimise(max_iterations=100, tolerance=1e-4)

    def take(self, nearby: LocalMatch) -> None:
        """The relations of a match join the graph."""
        if nearby.loop is not None:
            self.loops.append(nearby.loop)
        self.pairs.extend(nearby.pairwise)
        if nearby.nscan is not None:
            self.nscan.append(nearby.nscan)
        self.growth.matched(nearby.moved)

    def refine(self) -> None:
        """Step 6: the matches again, until they move nothing that was matched."""
        options = self.options
        # The poses are right to centimetres: the last stage is all it takes.
        last = dataclasses.replace(options.nscan, widenings=options.nscan.widenings[-1:])
        wider = {place.centre: place.radius for place in self.places}
        refinement = Refinement(self.route, last, self.match, wider, self.threads)
        for _ in range(options.refinements):
            if not refinement.sweep(self.poses, options.refined):
                break
            self.pairs, self.nscan = refinement.relations()
            self.energies.forget()
            self.loops = refinement.loops()
            self.optimise(max_iterations=100, tolerance=1e-6)
            self.reject()

    def reject(self) -> None:
        """Loops that contradict the rest of the graph are taken back."""
        relations = self.relations
        energy = self.energies.of(self.route, relations)
        doubted = np.array([relation.origin == "loop" for relation in relations], dtype=np.bool_)
        wrong = contradicting(energy, self.poses, doubted)
        if not wrong.any():
            return
        gone = [relation for relation, is_wrong in zip(relations, wrong, strict=True) if is_wrong]
        self.pairs = [pair for pair in self.pairs if not any(pair is each for each in gone)]
        self.nscan = [joint for joint in self.nscan if not any(joint is each for each in gone)]
        self.others = [other for other in self.others if not any(other is each for each in gone)]
        centres = {each.nodes[each.fixed] if isinstance(each, NScan) else each.nodes[1] for each in gone}
        self.loops = [
            dataclasses.replace(loop, accepted=False, reason=CONTRADICTS)
            if loop.accepted and loop.nodes[1] in centres
            else loop
            for loop in self.loops
        ]
        self.optimise(max_iterations=100, tolerance=1e-6)

    def optimise(self, max_iterations: int, tolerance: float, part: Subgraph | None = None) -> None:
        """Step 5: the global poses of all keyframes, or of a part, from all relations (paper, IV)."""
        part = Subgraph(self.relations) if part is None else part
        self.growth.optimised(len(self.poses), part)
        if len(self.poses) < 2:
            return
        energy = self.energies.of(self.route, part.relations, 0, part.free)
        self.route = self.route._replace(poses=optimise(energy, self.poses, max_iterations, tolerance).poses)

    @property
    def poses(self) -> Array:
        """(K, 3) where the graph has the keyframes."""
        return self.route.poses

    @property
    def relations(self) -> list[Relation]:
        """All relations of the graph, in its order."""
        return [*self.pairwise, *self.nscan, *self.others]

    def closed(self) -> list[Relation]:
        """Those that close loops."""
        matched: list[Relation] = [*self.pairs, *self.nscan, *self.others]
        return [relation for relation in matched if relation.origin == "loop"]

    @property
    def pairwise(self) -> list[Pairwise]:
        """The pairwise relations of the graph: the chain, or what is needed of it, and single matches."""
        chain = self.route.chain[: max(len(self.poses) - 1, 0)]
        if self.options.relations != "nscan":
            return [*chain, *self.pairs]
        joined = {pair for relation in self.nscan for pair in itertools.pairwise(relation.nodes)}
        return [relation for relation in chain if relation.nodes not in joined]

    def graph(self) -> Graph:
        """Every scan with its pose: a keyframe where the graph put it, the others in between."""
        keyframes = np.array([keyframe.row for keyframe in self.keyframes.list], dtype=np.int64)
        anchors = keyframes[np.searchsorted(keyframes, np.arange(len(self.log)), side="right") - 1]
        return Graph(
            scans=self.log.numbers,
            stamps=list(self.log.stamps),
            poses=between_keyframes(np.concatenate(self.tracked), keyframes, self.poses, self.breaks),
            odometry=self.log.odometry,
            anchors=anchors,
            pairwise=self.pairwise,
            nscan=self.nscan,
            others=self.others,
            loops=self.loops + self.closing.refused(),
        )
