"""A cache of the terms of a growing graph's energy (paper, V)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.term_cache import TermCache
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Mask
from nscan_cli.slam.keyframes.route import Route


class EnergyCache:
    """Energies of the keyframes of a route in a log of `scans` scans. The terms of relations are cached."""

    def __init__(self, scans: int) -> None:
        self._scans, self._terms = scans, TermCache()

    def forget(self) -> None:
        """Drop all terms, once their relations have been replaced."""
        self._terms = TermCache()

    def of(
        self, route: Route, relations: Sequence[Relation], fixed: int = 0, free: Mask | None = None
    ) -> GraphEnergy:
        """The energy of all keyframes. `fixed` is held, and so are the keyframes that are not `free` (K,)."""
        positions = np.full(self._scans, -1)
        positions[route.rows] = np.arange(len(route.rows))
        return GraphEnergy(len(route.rows), relations, positions, fixed, self._terms, free)
