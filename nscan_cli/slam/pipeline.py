"""The SLAM loop (paper, V): from the scans of a log to a pose graph."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable

import numpy as np

from nscan_cli.graph.marginals import marginal_covariances
from nscan_cli.graph.model import Graph, Loop, NScan, Pairwise
from nscan_cli.graph.optimise import optimise
from nscan_cli.graph.system import GraphEnergy
from nscan_cli.logs.scan import LaserLog
from nscan_cli.poses import Array, compose
from nscan_cli.slam.keyframes import Keyframes
from nscan_cli.slam.nearby import MatchNearby, match_nearby
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pairs_nearby import match_pairs_nearby
from nscan_cli.slam.refinement import Refinement
from nscan_cli.slam.tracking import Tracked, Tracker
from nscan_cli.slam.trajectory import between_keyframes

Report = Callable[[int, int], None]
"""Called with the scans and keyframes done."""


class Slam:
    """The state of the loop: what was tracked, the keyframes, their relations and their poses."""

    def __init__(self, log: LaserLog, options: SlamOptions) -> None:
        self.log, self.options = log, options
        self.tracker = Tracker(options.tracking)
        seen = log.ranges[log.ranges < options.tracking.reach]
        median_range = float(np.median(seen)) if len(seen) else 0.0
        self.keyframes = Keyframes(options.keyframes, options.nscan.gaussians, median_range)
        self.tracked: list[Array] = []
        self.anchors: list[int] = []
        self.match: MatchNearby = match_pairs_nearby if options.relations == "pairwise" else match_nearby
        self.chain: list[Pairwise] = []
        self.pairs: list[Pairwise] = []
        self.nscan: list[NScan] = []
        self.loops: list[Loop] = []
        self.poses = np.zeros((0, 3))
        self._moved = 0.0

    def run(self, report: Report) -> Graph:
        """The paper's loop over all scans, and the last optimisation."""
        for row in range(len(self.log)):
            points = self.points(row)
            tracked = self.track(row, points)
            if self.keyframes.near_enough(tracked):
                self.keyframes.attach(points, tracked)
            else:
                self.add_keyframe(row, points, tracked)
                self.match_nearby(len(self.keyframes) - 2)
            self.anchors.append(self.keyframes.list[-1].row)
            report(row + 1, len(self.keyframes))
        self.keyframes.finish_last()
        self.match_nearby(len(self.keyframes) - 1)
        self.optimise(max_iterations=100, tolerance=1e-6)
        self.refine()
        graph = self.graph()
        graph.marginals = marginal_covariances(graph)
        return graph

    def points(self, row: int) -> Array:
        """The points (m, 2) of a scan that are matched: those within reach."""
        points = self.log.points(row)
        near = np.hypot(points[:, 0], points[:, 1]) < self.options.tracking.reach
        return np.ascontiguousarray(points[near])

    def track(self, row: int, points: Array) -> Tracked:
        """Step 1: the pose of a scan by matching it with the map of the last metres."""
        odometry = None if self.log.odometry is None else self.log.odometry[row]
        tracked = self.tracker.track(points, odometry)
        self.tracked.append(tracked.pose)
        return tracked

    def add_keyframe(self, row: int, points: Array, tracked: Tracked) -> None:
        """Step 2: a new keyframe, with its relation to the one before."""
        self.keyframes.add(row, points, tracked)
        if len(self.keyframes) == 1:
            self.poses = np.zeros((1, 3))
            return
        relation = self.keyframes.relation_to_previous()
        self.chain.append(relation)
        self.poses = np.vstack([self.poses, compose(self.poses[-1], relation.measurement)])

    def match_nearby(self, newest: int) -> None:
        """Step 3: a keyframe matched with those near it; the graph follows when it must."""
        if newest < 0:
            return
        known = newest + 1
        nearby = self.match(
            self.keyframes.list[:known], self.poses[:known], self.chain, newest, self.options.nscan
        )
        if nearby is None:
            return
        if nearby.loop is not None:
            self.loops.append(nearby.loop)
        self.pairs.extend(nearby.pairwise)
        if nearby.nscan is not None:
            self.nscan.append(nearby.nscan)
        self._moved += nearby.moved
        if self._moved > self.options.optimise_after:
            self.optimise(max_iterations=10, tolerance=1e-3)

    def refine(self) -> None:
        """Step 5: the matches again, until they move nothing that was matched."""
        options = self.options
        # The poses are right to centimetres: the last stage is all it takes.
        last = dataclasses.replace(options.nscan, widenings=options.nscan.widenings[-1:])
        refinement = Refinement(self.keyframes.list, self.chain, last, self.match)
        for _ in range(options.refinements):
            if not refinement.sweep(self.poses, options.refined):
                break
            self.pairs, self.nscan = refinement.relations()
            self.loops = refinement.loops()
            self.optimise(max_iterations=100, tolerance=1e-6)

    def optimise(self, max_iterations: int, tolerance: float) -> None:
        """The global poses of all keyframes from all relations (paper, IV)."""
        self._moved = 0.0
        if len(self.keyframes) < 2:
            return
        positions = np.full(len(self.log), -1)
        positions[[keyframe.row for keyframe in self.keyframes.list]] = np.arange(len(self.keyframes))
        energy = GraphEnergy(len(self.poses), self.pairwise, self.nscan, positions)
        self.poses = optimise(energy, self.poses, max_iterations, tolerance).poses

    @property
    def pairwise(self) -> list[Pairwise]:
        """The pairwise relations of the graph: the chain, or what is needed of it, and single matches."""
        if self.options.relations != "nscan":
            return self.chain + self.pairs
        joined = {pair for relation in self.nscan for pair in itertools.pairwise(relation.nodes)}
        return [relation for relation in self.chain if relation.nodes not in joined]

    def graph(self) -> Graph:
        """Every scan with its pose: a keyframe where the graph put it, the others in between."""
        anchors = np.array(self.anchors, dtype=np.int64)
        keyframes = np.array([keyframe.row for keyframe in self.keyframes.list], dtype=np.int64)
        return Graph(
            scans=self.log.numbers,
            stamps=list(self.log.stamps),
            poses=between_keyframes(np.array(self.tracked), keyframes, self.poses),
            odometry=self.log.odometry,
            anchors=anchors,
            pairwise=self.pairwise,
            nscan=self.nscan,
            loops=self.loops,
        )
