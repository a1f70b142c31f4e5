"""Which keyframes have been matched with each other already, so that no match is made twice over."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from nscan_cli.slam.nearby import Nearby


class Coverage:
    """Pairs of keyframes, by their nodes; those of the coverage `beneath` too, to which nothing is added."""

    def __init__(self, beneath: Coverage | None = None) -> None:
        self._pairs: set[tuple[int, int]] = set()
        self._beneath = set() if beneath is None else beneath._pairs

    def share(self, centre: int, others: Iterable[int]) -> float:
        """The share of the pairs of `centre` with each of the others that are there; 1 without any other."""
        pairs = _pairs(centre, others)
        return (
            sum(pair in self._pairs or pair in self._beneath for pair in pairs) / len(pairs) if pairs else 1.0
        )

    def add(self, centre: int, others: Iterable[int], nearby: Nearby | None) -> None:
        """A match of `centre` with all others that was tried, and what it related."""
        self._pairs.update(_pairs(centre, others))
        for relation in [] if nearby is None else nearby.relations:
            self.relate(relation.nodes)

    def relate(self, nodes: Iterable[int]) -> None:
        """Every keyframe has been matched with every other."""
        self._pairs.update(combinations(sorted(set(nodes)), 2))


def _pairs(centre: int, others: Iterable[int]) -> list[tuple[int, int]]:
    return [(min(centre, other), max(centre, other)) for other in others if other != centre]
