"""The energy of a graph that grows (paper, V): of all relations, or of those among some keyframes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.graph.columns import Terms
from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.pattern import Indices
from nscan_cli.graph.relation import Relation
from nscan_cli.graph.system import GraphEnergy
from nscan_cli.slam.keyframes import Route


class Energies:
    """Those of the keyframes of a route in a log of so many `scans`; terms of relations are kept."""

    def __init__(self, scans: int) -> None:
        self._scans, self._terms = scans, Terms()

    def whole(self, route: Route, relations: Sequence[Relation], fixed: int = 0) -> GraphEnergy:
        """That of all keyframes with keyframe `fixed` held."""
        every = np.arange(len(route.poses))
        return GraphEnergy(len(every), relations, self._positions(route, every), fixed, self._terms)

    def part(
        self, route: Route, way: Sequence[Pairwise], loops: Sequence[Relation], fixed: int, among: Indices
    ) -> GraphEnergy:
        """That of some keyframes (m,) alone, increasing, whose places are the energy's; one is `fixed`.

        Of the relations, those that are between these: `way[k]` leads from keyframe k to k + 1.
        """
        positions = self._positions(route, among)
        inside = (positions >= 0).tolist()
        steps = [way[k] for k in among[:-1][np.diff(among) == 1].tolist()]
        closed = [relation for relation in loops if all(inside[node] for node in relation.nodes)]
        held = int(np.searchsorted(among, fixed))
        return GraphEnergy(len(among), [*steps, *closed], positions, held, self._terms)

    def _positions(self, route: Route, among: Indices) -> Indices:
        """(S,) the place of each scan among some keyframes; −1 for others."""
        positions = np.full(self._scans, -1)
        positions[route.rows(among.tolist())] = np.arange(len(among))
        return positions
