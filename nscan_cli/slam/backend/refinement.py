"""Refinement: all local matches are made again from the optimised poses (step 6 of the loop).

A match that was made while the graph grew knew only earlier scans, and started from poses that later loops
corrected. From the final poses, and with the scans of all visits, some matches find a better optimum. Then
the graph moves, and keyframes whose neighbours have moved are matched again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.graph.model import Loop, NScan, Pairwise
from nscan_cli.matching.pose_kernels import largest_motion
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.backend.loop_rejection import reject_contradicting_loops
from nscan_cli.slam.backend.optimisation import optimise
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.coverage import Coverage
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, LocalMatcher
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.loop_closure.close_loops import close_loops_left_open
from nscan_cli.slam.loop_closure.place import Place
from nscan_cli.slam.state import SlamState
from nscan_cli.threads import map_in_threads


def refine(state: SlamState, search: bool = True) -> None:
    """Make the local matches again, until they move no member.

    After the first pass, keyframes that no loop relates to an earlier visit nearby are searched, unless
    `search` is off. Changes relations, energies, loops, places, route, schedule, detector.
    """
    options = state.options
    # The poses are right to centimetres: the last stage is all it takes.
    last = replace(options.nscan, widenings=options.nscan.widenings[-1:])
    refinement = Refinement(state.route, last, state.match, state.places, state.threads)
    for done in range(options.refinement.max_passes):
        if not refinement.run_pass(state.poses, options.refinement.min_motion):
            break
        state.matched_pairs, state.nscan_relations = refinement.relations()
        state.energies.forget()
        state.loops = refinement.loops()
        optimise(state, options.optimisation.final)
        reject_contradicting_loops(state)
        if done == 0 and search and options.nscan.loops:
            refinement.match_at(close_loops_left_open(state))


class Refinement:
    """The relations about all keyframes, each from the poses of its last match."""

    def __init__(
        self,
        route: Route,
        options: NScanOptions,
        match: LocalMatcher,
        places: Sequence[Place],
        threads: int = 1,
    ) -> None:
        """At the `places` where a search closed loops, matches are made as there."""
        self._route, self._options, self._match, self._threads = route, options, match, threads
        self._covered, self._wider = Coverage(), dict[int, NScanOptions]()
        self._found: list[LocalMatch | None] = [None] * len(route.poses)
        self._starts: list[tuple[Indices, Array] | None] = [None] * len(route.poses)
        self.match_at(places)

    def match_at(self, places: Sequence[Place]) -> None:
        """Let the next pass match about the centres of these places, as a search matched there."""
        for place in places:
            self._wider[place.centre] = replace(place.options, widenings=self._options.widenings)
            self._starts[place.centre] = None

    def run_pass(self, poses: Array, moved: float) -> int:
        """Match again about the keyframes whose neighbours have moved by more than `moved` (m, rad).

        `poses` (K, 3) are the global ones; returns how many were matched. Those that are chosen together
        are matched side by side. No joint match is made twice: it would fail again, or count twice.
        """
        route, matched = self._route._replace(poses=poses), 0
        waiting = {
            k: choose_neighbours(poses, route.paths, k, self._options_of(k))
            for k in range(len(poses))
            if self._has_moved(k, poses, moved)
        }
        while chosen := self._uncovered(route, waiting):
            found = map_in_threads(
                self._threads,
                lambda centre: self._match(route, centre, chosen[centre], self._options_of(centre)),
                chosen,
            )
            for (centre, near), local_match in zip(chosen.items(), found, strict=True):
                self._covered.add(int(route.rows[centre]), route.rows[near.members].tolist(), local_match)
                self._starts[centre] = near.members, poses[near.members]
                self._found[centre] = local_match
                waiting.pop(centre, None)
                # About these the same match would be made, with the same neighbours.
                alike = () if local_match is None else local_match.alike & (waiting.keys() - self._wider)
                for other in [k for k in alike if np.array_equal(waiting[k].members, near.members)]:
                    self._starts[other] = self._found[other] = None
                    waiting.pop(other)
            matched += len(chosen)
        return matched

    def _uncovered(self, route: Route, waiting: Mapping[int, Neighbours]) -> dict[int, Neighbours]:
        """The centres to match next among the waiting ones, with their neighbours.

        Each match is assumed to relate all its members. If one does not, the next choice makes up for it.
        """
        chosen, covered, sets = dict[int, Neighbours](), Coverage(beneath=self._covered), set[bytes]()
        for centre, near in waiting.items():
            needed = self._starts[centre] is not None or centre in self._wider
            members = near.members.tobytes()
            if members not in sets and (needed or covered.is_due(route, centre, near, self._options)):
                sets.add(members)
                chosen[centre] = near
                covered.assume(route, centre, near)
        return chosen

    def _options_of(self, centre: int) -> NScanOptions:
        return self._wider.get(centre, self._options)

    def relations(self) -> tuple[list[Pairwise], list[NScan]]:
        """The relations as they are now: of single matches, and of joint ones."""
        found = [each for each in self._found if each is not None]
        pairs = [relation for each in found for relation in each.pairwise]
        return pairs, [each.nscan for each in found if each.nscan is not None]

    def loops(self) -> list[Loop]:
        """The verdicts on other visits that these relations come from."""
        return [each.loop for each in self._found if each is not None and each.loop is not None]

    def _has_moved(self, centre: int, poses: Array, moved: float) -> bool:
        start = self._starts[centre]
        if start is None:
            return True
        members, before = start
        return max(largest_motion(before, poses[members], int(np.searchsorted(members, centre)))[1:]) > moved
