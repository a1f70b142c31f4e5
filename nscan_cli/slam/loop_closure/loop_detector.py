"""Step 4 of the loop: large loops, where drift has carried the path away from a place seen before (paper, V).

A joint match needs a start within a metre. Where the graph knows less than that of how a keyframe lies to an
older one that may be near, or a joint match has left out all scans of another visit, the place is searched.
It counts when a second keyframe, searched by itself, agrees. A loop that a joint match has closed from such a
start must stand the search too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Loop, Pairwise
from nscan_cli.graph.relations.base import Relation
from nscan_cli.matching.correlative_search import SearchOptions
from nscan_cli.poses import Array, Indices, compose, relative, wrap
from nscan_cli.slam.backend.energy_cache import EnergyCache
from nscan_cli.slam.backend.subgraph import Subgraph, nearest_keyframes, without_others
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.keyframes.tracked_path import TrackedPath
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, MatchNearby
from nscan_cli.slam.loop_closure.most_certain_paths import Linked, most_certain_paths, relations_on_paths
from nscan_cli.slam.loop_closure.place_search import Place, find_place, why_doubted
from nscan_cli.slam.loop_closure.relative_uncertainty import RelativeSigma, RelativeUncertainty
from nscan_cli.slam.options import ClosingOptions, NScanOptions

NO_SECOND = "no second keyframe finds the same"
SO_FAR_OFF = "too few keyframes find the same, farther off than the path drifts"
LOST = "tracking has broken since: the place must be searched"

Loops = Callable[[], list[Relation]]


class LoopDetector:
    """The search for large loops, keyframe by keyframe; `energies` makes those of the graph."""

    def __init__(
        self, options: ClosingOptions, nscan: NScanOptions, match: MatchNearby, energies: EnergyCache
    ) -> None:
        self.options, self.nscan, self.match, self.energies = options, nscan, match, energies
        self.way = TrackedPath(options.drift, options.drift_angle)
        self._refused: list[Loop] = []
        self._waiting: list[tuple[Place, str]] = []
        self._whereabouts, self._linked = RelativeUncertainty(), Linked()
        self._searched = -np.inf

    def extend(self, relation: Pairwise, length: float) -> None:
        """Follow the chain by a relation over a way of `length` (m)."""
        self.way.extend(relation, length)

    def close(
        self,
        route: Route,
        centre: int,
        left_out: Indices,
        loops: Loops,
    ) -> list[Place]:
        """The places of a keyframe, and of those before that agree with it, if they are enough, or none.

        `left_out` (m,) are keyframes of another visit that the joint match about `centre` was tried with.
        `loops` gives the relations that close loops so far.
        """
        if route.paths[centre] - self._searched < self.options.step:
            return []
        bound = self._whereabouts.bound(centre, self.way, route.poses)
        if not len(self._near(route, centre, bound)) and not len(left_out):
            return []
        bound, before = self._narrow(route, centre, loops)
        if not len(self._near(route, centre, bound)) and not len(left_out):
            return []
        reach = self._ask(route, centre, bound, before, loops)
        near = np.union1d(self._near(route, centre, reach), left_out).astype(np.int64)
        if not len(near):
            return []
        self._searched = route.paths[centre]
        place = self._search(route, centre, near, reach)
        if place is None:
            return []
        agreeing = [*(other for other, _ in self._waiting if self._agree(other, place, route)), place]
        reason = self._why_too_few(agreeing, route, reach)
        if reason is not None:
            self._waiting.append((place, reason))
            return []
        self._waiting = [each for each in self._waiting if each[0] not in agreeing]
        return agreeing

    def _why_too_few(self, agreeing: list[Place], route: Route, reach: RelativeSigma) -> str | None:
        """Why keyframes that agree on a place are too few, or None; `reach` is that of the last of them.

        A place that is farther off than the path drifts is mostly one that looks alike, while the right one
        has never been seen. What looks alike ends somewhere: scans far apart have to agree there.
        """
        options, place, first = self.options, agreeing[-1], agreeing[0]
        lost = bool(self.is_lost(reach)[place.old])
        off = relative(route.poses[place.centre], route.poses[place.old]) - place.measured
        likely = max(options.likely * reach.distance[place.old], options.slip)
        surprises = not lost and np.hypot(off[0], off[1]) > likely
        if len(agreeing) < (options.agreeing_lost if lost or surprises else options.agreeing):
            return SO_FAR_OFF if surprises else NO_SECOND
        share_scans = route.paths[place.centre] - route.paths[first.centre] < 2 * options.beside
        return SO_FAR_OFF if surprises and share_scans else None

    def why_doubted(
        self,
        route: Route,
        centre: int,
        nearby: LocalMatch,
        loops: Loops,
    ) -> str | None:
        """Why the place is not sure that the joint match about `centre` has in an earlier visit, or None.

        Arguments as for close. A match that began near enough, or closes no loop, is not doubted.
        """
        poses = route.poses
        tie = nearby.tie(int(route.rows[centre]))
        if tie is None:
            return None
        old = int(np.searchsorted(route.rows, tie[0]))
        if not self._may_be_off(self._whereabouts.bound(centre, self.way, poses), old):
            return None
        bound, before = self._narrow(route, centre, loops)
        if not self._may_be_off(bound, old):
            return None
        reach = self._ask(route, centre, bound, before, loops)
        if not self._may_be_off(reach, old):
            return None
        if self.is_lost(reach)[old]:
            return LOST
        window, earlier = self._visit(route, centre, old, reach)
        pose = compose(poses[old], tie[1])
        joint = None if nearby.nscan is None else self.nscan
        return why_doubted(route, centre, pose, earlier, window, self.options, joint)

    def _narrow(self, route: Route, centre: int, loops: Loops) -> tuple[RelativeSigma, Indices]:
        """A bound on the reach again, by the surest ways; and what is before each (K,) on its way."""
        links = self._linked.links(route, self.way, loops())
        covariances, before = most_certain_paths(links, route.poses, centre)
        return self._whereabouts.narrow(centre, covariances), before

    def _ask(
        self, route: Route, centre: int, bound: RelativeSigma, before: Indices, loops: Loops
    ) -> RelativeSigma:
        """The reach, by the graph of the way and all loops.

        Of a large one, by what is nearest, and by the surest ways to all that may be searched.
        """
        part = Subgraph([*self.way.relations, *loops()])
        if len(route.rows) > self.options.asked:
            wanted = nearest_keyframes(route.poses, centre, centre + 1, self.options.asked)
            wanted |= _away(route, centre) <= self.options.around + self._farthest(bound)
            part = without_others(route, self.way.relations, loops(), relations_on_paths(before, wanted))
        energy = self.energies.of(route, part.relations, centre, part.free)
        return self._whereabouts.ask(energy, route.poses)

    def is_lost(self, reach: RelativeSigma) -> NDArray[np.bool_]:
        """Which keyframes (K,) the graph does not know even the direction of: the track has broken since."""
        lost: NDArray[np.bool_] = self.options.deviations * reach.angle >= np.pi
        return lost

    def _farthest(self, reach: RelativeSigma) -> Array:
        """(K,) how far (m) keyframes are searched at most."""
        return np.where(self.is_lost(reach), self.options.lost, self.options.farthest)

    def _may_be_off(self, reach: RelativeSigma, keyframe: int) -> bool:
        """Whether a keyframe may be too far off for a joint match."""
        return bool(self.options.deviations * reach.distance[keyframe] > self.options.settled)

    def refused(self) -> list[Loop]:
        """The verdicts on what was not accepted."""
        waiting = [(place.nearby.loop, reason) for place, reason in self._waiting]
        return self._refused + [
            replace(loop, accepted=False, reason=reason) for loop, reason in waiting if loop is not None
        ]

    def _near(self, route: Route, centre: int, reach: RelativeSigma) -> Indices:
        """The older keyframes that may be near, but may be too far off for a joint match."""
        options, paths, away = self.options, route.paths, _away(route, centre)
        bound = options.deviations * reach.distance
        may_be = away <= self.nscan.radius + np.minimum(bound, self._farthest(reach))
        older = paths[centre] - paths > self.nscan.recent
        return np.flatnonzero(older & may_be & (bound > options.settled))

    def _search(
        self,
        route: Route,
        centre: int,
        near: Indices,
        reach: RelativeSigma,
    ) -> Place | None:
        """Search among the visit that most likely is near, or, when not even the direction is known, all."""
        away = _away(route, centre)
        places, is_lost = [], self.is_lost(reach)
        while len(near):
            first = int(near[np.argmin(away[near] - self.options.deviations * reach.distance[near])])
            window, around = self._visit(route, centre, first, reach)
            found = find_place(route, centre, around, window, self.match, self.options, self.nscan)
            if isinstance(found, Loop):
                self._refused.append(found)
            elif found is not None:
                places.append(found)
            near = np.setdiff1d(near, [first, *around]) if is_lost[first] else near[:0]
        return max(places, key=_overlap, default=None)

    def _visit(
        self,
        route: Route,
        centre: int,
        first: int,
        reach: RelativeSigma,
    ) -> tuple[SearchOptions, Indices]:
        """Where to search keyframe `centre` about an older one, the `first`, and among which (m,).

        These are what the graph knows well as seen from the first: the map that they make is in one piece.
        `reach` is that from the centre, for which the graph was asked last.
        """
        options, paths, away = self.options, route.paths, _away(route, centre)
        farthest = min(float(self._farthest(reach)[first]), max(float(away.max()), options.farthest))
        distance = max(options.deviations * reach.distance[first], options.least)
        turn = max(options.deviations * reach.angle[first], options.least_turn)
        window = replace(options.search, distance=min(distance, farthest), turn=min(turn, float(np.pi)))
        older = paths[centre] - paths > self.nscan.recent
        near = away <= options.around + window.distance
        in_one_piece = options.deviations * self._whereabouts.asked_from(first).distance <= options.settled
        return window, np.flatnonzero(older & near & in_one_piece)

    def _agree(self, one: Place, other: Place, route: Route) -> bool:
        poses, paths = route.poses, route.paths
        off = one.corrected(poses, other.centre) - other.corrected(poses, other.centre)
        within = np.hypot(off[0], off[1]) <= self.options.agree
        turned = abs(wrap(off[2])) <= self.options.agree_turn
        return bool(within and turned and paths[other.centre] - paths[one.centre] <= self.options.together)


def _away(route: Route, centre: int) -> Array:
    """(K,) how far keyframes lie from one of them, m."""
    away: Array = np.hypot(*(route.poses[:, :2] - route.poses[centre, :2]).T)
    return away


def _overlap(place: Place) -> float:
    """How well the scans of both visits hang together there."""
    return 0.0 if place.nearby.loop is None else place.nearby.loop.score
