"""The state of the SLAM loop (paper, V), which the functions of its steps read and change."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from nscan_cli.graph.model import Loop, NScan, Pairwise
from nscan_cli.graph.relations.base import Relation
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.backend.energy_cache import EnergyCache
from nscan_cli.slam.backend.schedule import OptimisationSchedule
from nscan_cli.slam.frontend.odometry_checks import frozen_scans, restarts_of, without_jumps
from nscan_cli.slam.frontend.odometry_stalls import without_stalls
from nscan_cli.slam.keyframes.keyframe_selection import Keyframes
from nscan_cli.slam.keyframes.route import Route, route_of
from nscan_cli.slam.local_matching.coverage import Coverage
from nscan_cli.slam.local_matching.joint_relations import LocalMatcher, match_neighbours
from nscan_cli.slam.local_matching.pairwise_relations import match_neighbours_pairwise
from nscan_cli.slam.loop_closure.free_space_violations import FreeSpaceViolation
from nscan_cli.slam.loop_closure.loop_detector import LoopDetector
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.options import SlamOptions


@dataclass
class SlamState:
    """What the loop knows. `of_log` makes the state before the first scan.

    While the log is tracked, the tracking thread changes keyframes, chain, tracked and breaks; another thread
    that grows the graph may change the rest.
    """

    log: LaserLog
    """If the laser turns, each scan is at the time of its middle beam until the last optimisation."""
    recorded: LaserLog
    """The log as it was read: each scan is at the time of its stamp."""
    options: SlamOptions
    threads: int
    odometry: Array | None
    """(S, 3) odometry without its jumps; None without odometry."""
    odometry_jumps: Indices
    """(J,) rows to which the odometry jumped."""
    odometry_stalls: Indices
    """(J,) rows where the odometry moved on after it had stood while the robot drove."""
    frozen_scans: Indices
    """(H,) rows of scans that a laser repeated while the robot moved."""
    keyframes: Keyframes
    route: Route
    """The keyframes that are in the graph, and their global poses."""
    chain: list[Pairwise]
    """Relations of tracking: `chain[k]` leads from keyframe k to k + 1. The route holds the same list."""
    tracked: list[Array] = field(default_factory=list)
    """(n, 3) poses of the scans as tracking found them, batch by batch."""
    weakest_sigmas: list[Array] = field(default_factory=list)
    """(n,) standard deviations of the positions that scans measure, m, batch by batch; see TrackedScans."""
    breaks: list[int] = field(default_factory=list)
    """Rows of the keyframes before which the track broke, increasing."""
    matched_pairs: list[Pairwise] = field(default_factory=list)
    """Pairwise relations of matches between a keyframe and one neighbour."""
    odometry_relations: list[Pairwise] = field(default_factory=list)
    """What odometry says over breaks of the track, where loops agree with it."""
    nscan_relations: list[NScan] = field(default_factory=list)
    other_relations: list[Relation] = field(default_factory=list)
    """Relations of a saved graph that the loop does not make."""
    saved_relations: list[Relation] = field(default_factory=list)
    """Those of a saved graph: they are as uncertain as guesses make them."""
    saved_guesses: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(K − 1, 3) variances of what was guessed on the way of a saved graph; see `guess_variances`."""
    loops: list[Loop] = field(default_factory=list)
    """The verdicts on loops, accepted and refused ones."""
    places: list[Place] = field(default_factory=list)
    """Places of earlier visits that a search found."""
    judged: tuple[Route, FreeSpaceViolation | None] | None = None
    """The route that was compared with earlier visits last, and where it contradicts them most."""
    tracking_restarts: int = 0
    """Scan matches that tracking started again from other angles."""
    tracking_searches: int = 0
    """Searches of tracking for a scan among the last ones."""

    def __post_init__(self) -> None:
        options = self.options
        is_pairwise = options.relations == "pairwise"
        self.match: LocalMatcher = match_neighbours_pairwise if is_pairwise else match_neighbours
        self.energies, self.coverage = EnergyCache(len(self.log)), Coverage()
        self.detector = LoopDetector(options.loop_closure, options.nscan, self.match, self.energies)
        self.schedule = OptimisationSchedule(options.schedule)

    @classmethod
    def of_log(cls, log: LaserLog, options: SlamOptions, threads: int = 1) -> SlamState:
        """The state before the first scan of a log."""
        recorded, log = log, log.at_middle_of_sweeps().moving_along(None)
        odometry = log.odometry
        jumps = stalls = np.zeros(0, dtype=np.int64)
        if odometry is not None:
            odometry, stalls = without_stalls(odometry, log.times, options.odometry_checks.stalls)
            restarts = restarts_of(recorded, options.odometry_checks, options.breaks)
            odometry, jumps = without_jumps(odometry, log.times, options.odometry_checks, restarts)
        seen = log.ranges[log.ranges < options.tracking.max_range]
        median_range = float(np.median(seen)) if len(seen) else 0.0
        keyframes = Keyframes(options.keyframes, options.nscan.gaussians, median_range)
        chain: list[Pairwise] = []
        route = route_of(keyframes.list, chain, np.zeros((0, 3)))
        frozen = frozen_scans(log, odometry, options.odometry_checks)
        return cls(log, recorded, options, threads, odometry, jumps, stalls, frozen, keyframes, route, chain)

    def snapshot(self) -> Callable[[], None]:
        """A function that makes route, matched relations, loops and places what they are now, once."""
        route, pairs, joint = self.route, list(self.matched_pairs), list(self.nscan_relations)
        loops, places = list(self.loops), list(self.places)

        def restore() -> None:
            self.route, self.matched_pairs, self.nscan_relations = route, pairs, joint
            self.loops, self.places = loops, places
            self.energies.forget()

        return restore

    @property
    def poses(self) -> Array:
        """(K, 3) global poses of the keyframes in the graph."""
        return self.route.poses

    @property
    def degenerate_scans(self) -> Indices:
        """Rows of the tracked scans that, without odometry, do not tell their places along the walls."""
        sigma = self.options.degenerate_relations.stretch.sigma
        return np.flatnonzero(np.concatenate(self.weakest_sigmas) > sigma)

    @property
    def relations(self) -> list[Relation]:
        """All relations, in the order of the graph."""
        return [*self.pairwise_relations, *self.nscan_relations, *self.other_relations]

    @property
    def pairwise_relations(self) -> list[Pairwise]:
        """The chain, or what of it the options keep, the matched pairs, and odometry over breaks."""
        chain = self.route.chain[: max(len(self.poses) - 1, 0)]
        if self.options.relations != "nscan":
            return [*chain, *self.matched_pairs, *self.odometry_relations]
        joined = {pair for relation in self.nscan_relations for pair in itertools.pairwise(relation.nodes)}
        kept = [relation for relation in chain if relation.nodes not in joined]
        return [*kept, *self.odometry_relations]

    def loop_relations(self) -> list[Relation]:
        """The relations that close loops."""
        matched: list[Relation] = [*self.matched_pairs, *self.nscan_relations, *self.other_relations]
        return [relation for relation in matched if relation.origin == "loop"]
