"""Detection of large loops that drift has left open (paper, V: step 4 of the loop).

A joint match needs a start within a metre. A place is searched where the graph knows less than that about a
keyframe relative to an older one, or where a joint match left out all scans of another visit. A place counts
if a second keyframe, searched independently, agrees. A loop that a joint match closed from such a start needs
the same confirmation by the search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from nscan_cli.graph.model import Loop, Pairwise
from nscan_cli.graph.relations.base import Relation
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.poses import Array, Indices, compose
from nscan_cli.slam.backend.energy_cache import EnergyCache
from nscan_cli.slam.backend.subgraph import Subgraph, nearest_keyframes, without_others
from nscan_cli.slam.keyframes.route import Route, distances_from, is_earlier
from nscan_cli.slam.keyframes.tracked_path import TrackedPath
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, LocalMatcher
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.most_certain_paths import LinkCache, most_certain_paths, relations_on_paths
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.loop_closure.place_search import find_place, why_match_doubted
from nscan_cli.slam.loop_closure.relative_uncertainty import RelativeSigma, RelativeUncertainty
from nscan_cli.slam.loop_closure.search_turns import SearchTurns
from nscan_cli.slam.loop_closure.slip_evidence import SlipEvidence
from nscan_cli.slam.loop_closure.verification import LOST, is_lost, places_agree, why_too_few

Loops = Callable[[], list[Relation]]


class LoopDetector:
    """The search for large loops, keyframe by keyframe. `energies` gives the energies of the graph."""

    def __init__(
        self, options: LoopClosureOptions, nscan: NScanOptions, match: LocalMatcher, energies: EnergyCache
    ) -> None:
        self.options, self.nscan, self.match, self.energies = options, nscan, match, energies
        self.tracked_path = TrackedPath(options.drift, options.drift_angle)
        self._slips = SlipEvidence(options)
        self._refused: list[Loop] = []
        self._waiting: list[tuple[Place, str]] = []
        self._uncertainty, self._links = RelativeUncertainty(), LinkCache()
        self._searched, self._turns = -np.inf, SearchTurns(options)

    def begin_again(self, options: LoopClosureOptions) -> None:
        """Let the keyframes come anew, to be searched with these options.

        Verdicts stay; places that wait for a second keyframe are refused.
        """
        self.options = options
        self._refused, self._waiting = self.refused(), []
        self._searched, self._uncertainty = -np.inf, RelativeUncertainty()
        self._turns = SearchTurns(options)

    def extend(self, relation: Pairwise, length: float, odometry: Array | None = None) -> None:
        """Add a relation of the chain over a path of `length` (m); `odometry` (3,) is it by odometry."""
        slip = (0.0, 0.0)
        if odometry is not None:
            slip = self._slips.variances(relation.measurement, odometry, length)
        self.tracked_path.extend(relation, length, slip)

    def close(self, route: Route, centre: int, left_out: Indices, loops: Loops) -> list[Place]:
        """The places of a keyframe and of earlier ones that agree with it. Empty if they are too few.

        `left_out` (m,) are keyframes of another visit that the joint match about `centre` left out. `loops`
        gives the relations that close loops so far.
        """
        if route.paths[centre] - self._searched < self.options.search_interval:
            return []
        for sigma in self._uncertainties(route, centre, loops):
            near = np.union1d(self._near(route, centre, sigma), left_out).astype(np.int64)
            if not len(near):
                return []
        self._searched = route.paths[centre]
        place = self._search(route, centre, near, sigma)
        if place is None:
            return []
        agreeing = [
            *(other for other, _ in self._waiting if places_agree(other, place, route, self.options)),
            place,
        ]
        reason = why_too_few(agreeing, route, sigma, self.options)
        if reason is not None:
            self._waiting.append((place, reason))
            return []
        self._waiting = [each for each in self._waiting if each[0] not in agreeing]
        return agreeing

    def why_doubted(self, route: Route, centre: int, local_match: LocalMatch, loops: Loops) -> str | None:
        """Why the joint match about `centre` may be at a wrong place of an earlier visit, or None.

        Arguments as for close. A match that started near enough, or closes no loop, is not doubted.
        """
        tie = local_match.tie(int(route.rows[centre]))
        if tie is None:
            return None
        old = int(np.searchsorted(route.rows, tie[0]))
        for sigma in self._uncertainties(route, centre, loops):
            if not self.options.sigmas * sigma.distance[old] > self.options.match_reach:
                return None
        if is_lost(sigma, self.options)[old]:
            return LOST
        window, earlier = self._visit(route, centre, old, sigma)
        pose = compose(route.poses[old], tie[1])
        joint = None if local_match.nscan is None else self.nscan
        return why_match_doubted(route, centre, pose, earlier, window, self.options, joint)

    def _uncertainties(self, route: Route, centre: int, loops: Loops) -> Iterator[RelativeSigma]:
        """Upper bounds by the tracked path and by the most certain paths, then what the graph says.

        Each takes far longer than the one before.
        """
        yield self._uncertainty.upper_bound(centre, self.tracked_path, route.poses)
        links = self._links.links(route, self.tracked_path, loops())
        covariances, before = most_certain_paths(links, route.poses, centre, self.options.lever_arm)
        yield self._uncertainty.tighten(centre, covariances)
        yield self._computed(route, centre, before, loops)

    def _computed(self, route: Route, centre: int, before: Indices, loops: Loops) -> RelativeSigma:
        """The uncertainty by the graph of the tracked path and all loops.

        Of a large graph, only the part nearest to the centre counts, and the paths to all keyframes that may
        be searched. `before` (K,) is the keyframe before each on its most certain path.
        """
        part = Subgraph([*self.tracked_path.relations, *loops()])
        if len(route.rows) > self.options.max_exact_keyframes:
            wanted = nearest_keyframes(route.poses, centre, centre + 1, self.options.max_exact_keyframes)
            wanted |= distances_from(route, centre) <= self.options.earlier_radius + self.options.max_distance
            part = without_others(
                route, self.tracked_path.relations, loops(), relations_on_paths(before, wanted)
            )
        energy = self.energies.of(route, part.relations, centre, part.free)
        return self._uncertainty.compute(energy, route.poses)

    def refused(self) -> list[Loop]:
        """The verdicts on places that were not accepted."""
        waiting = [(place.local_match.loop, reason) for place, reason in self._waiting]
        return self._refused + [
            replace(loop, accepted=False, reason=reason) for loop, reason in waiting if loop is not None
        ]

    def _near(self, route: Route, centre: int, sigma: RelativeSigma) -> Indices:
        """The older keyframes that may be near and may be too far off for a joint match."""
        options, away = self.options, distances_from(route, centre)
        bound = options.sigmas * sigma.distance
        may_be = away <= self.nscan.radius + np.minimum(bound, options.max_distance)
        older = is_earlier(route, centre, self.nscan.visit_path)
        return np.flatnonzero(older & may_be & (bound > options.match_reach))

    def _search(self, route: Route, centre: int, near: Indices, sigma: RelativeSigma) -> Place | None:
        """The place, of those found in pieces of the map, that fits best."""
        places = []
        for window, around in self._pieces(route, centre, near, sigma):
            found = find_place(route, centre, around, window, self.match, self.options, self.nscan)
            self._turns.took(around, route.paths[centre], found is not None)
            if isinstance(found, Loop):
                self._refused.append(found)
            elif found is not None:
                places.append(found)
        return max(places, key=_visit_overlap, default=None)

    def _pieces(
        self, route: Route, centre: int, near: Indices, sigma: RelativeSigma
    ) -> list[tuple[SearchOptions, Indices]]:
        """Where to search: the visit that is most likely near, as by _visit.

        If not even the direction is known, all pieces of the map may be near, and those whose turn it is are
        searched.
        """
        away = distances_from(route, centre)
        lost, known, pieces = is_lost(sigma, self.options), [], []
        while len(near):
            first = int(near[np.argmin(away[near] - self.options.sigmas * sigma.distance[near])])
            window, around = self._visit(route, centre, first, sigma)
            if not lost[first]:
                known.append((window, around))
                break
            if len(around) >= self.options.min_lost_visit:
                pieces.append((window, around))
            near = np.setdiff1d(near, [first, *around])
        turns = self._turns.next([around for _, around in pieces])
        return [*(pieces[turn] for turn in turns), *known]

    def _visit(
        self, route: Route, centre: int, first: int, sigma: RelativeSigma
    ) -> tuple[SearchOptions, Indices]:
        """Where to search keyframe `centre` about an older one, the `first`, and among which keyframes (m,).

        These are the keyframes that the graph knows well as seen from the first, so that their map is in one
        piece. `sigma` is that from the centre, for which it was computed last.
        """
        options, away = self.options, distances_from(route, centre)
        farthest = min(max(float(away.max()), 0.5 * options.max_distance), options.max_distance)
        distance = max(options.sigmas * sigma.distance[first], options.min_distance)
        turn = max(options.sigmas * sigma.angle[first], options.min_turn)
        window = replace(options.search, distance=min(distance, farthest), turn=min(turn, float(np.pi)))
        older = is_earlier(route, centre, self.nscan.visit_path)
        near = away <= options.earlier_radius + window.distance
        in_one_piece = options.sigmas * self._uncertainty.seen_from(first).distance <= options.match_reach
        return window, np.flatnonzero(older & near & in_one_piece)


def _visit_overlap(place: Place) -> float:
    return 0.0 if place.local_match.loop is None else place.local_match.loop.score
