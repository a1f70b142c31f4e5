"""Which keyframes have been matched with each other already, so that matches do not repeat each other."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable

from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.neighbours import Neighbours
from nscan_cli.slam.local_matching.options import NScanOptions


class Coverage:
    """Pairs of keyframes that matches relate, by their nodes. Pairs of the coverage `beneath` count too; it
    is not changed."""

    def __init__(self, beneath: Coverage | None = None) -> None:
        self._partners: defaultdict[int, set[int]] = defaultdict(set)
        self._closed: set[int] = set()
        self._beneath = beneath

    def is_due(self, route: Route, centre: int, near: Neighbours, options: NScanOptions) -> bool:
        """Whether a match about `centre` with its neighbours would add new relations.

        It is not due where other matches hold most of its pairs. From the third visit on, it is not due
        either if a joint match that closed a loop has a centre so near along the path that both would contain
        the same keyframes of this visit. On repeated rounds such matches would not improve the graph, and
        only make it harder to solve.
        """
        if near.visits > 1:
            half = options.max_scans // 2
            beside = route.rows[max(centre - half + 1, 0) : centre + half].tolist()
            if self._has_closed(beside):
                return False
        return (
            self.share(int(route.rows[centre]), route.rows[near.members].tolist()) < options.max_covered_share
        )

    def share(self, centre: int, others: Iterable[int]) -> float:
        """The share of covered pairs among those of `centre` and each of the others; 1 without others."""
        others = {*others} - {centre}
        return 1.0 if not others else (len(others) - len(self._lacking(centre, others))) / len(others)

    def add(self, centre: int, others: Collection[int], local_match: LocalMatch | None) -> None:
        """Add the pairs of a match about `centre` with its members, and the relations that the match gave."""
        self._partners[centre].update(others)
        for other in others:
            self._partners[other].add(centre)
        if local_match is None:
            return
        for relation in local_match.relations:
            self._relate(relation.nodes)
        if local_match.nscan is not None and local_match.nscan.origin == "loop":
            self._closed.add(centre)

    def assume(self, route: Route, centre: int, near: Neighbours) -> None:
        """Add the pairs of a match about `centre` that is still to be made, as if it related all members."""
        self._relate(route.rows[near.members].tolist())
        if near.from_other_visit.any():
            self._closed.add(int(route.rows[centre]))

    def _relate(self, nodes: Collection[int]) -> None:
        for node in nodes:
            self._partners[node].update(nodes)

    def _lacking(self, centre: int, others: set[int]) -> set[int]:
        lacking = others - self._partners.get(centre, set())
        return lacking if self._beneath is None else self._beneath._lacking(centre, lacking)

    def _has_closed(self, nodes: Iterable[int]) -> bool:
        here = not self._closed.isdisjoint(nodes)
        return here or (self._beneath is not None and self._beneath._has_closed(nodes))
