"""The schedule of optimisation while the graph grows: when, and how much of the graph (paper, V: step 5).

A small graph is always optimised as a whole, a large one mostly near the new keyframes. So the time grows in
proportion to the log.
"""

from __future__ import annotations

from collections.abc import Sequence

from nscan_cli.graph.relations.base import Relation
from nscan_cli.slam.backend.options import ScheduleOptions
from nscan_cli.slam.backend.subgraph import Subgraph, held_by_others, nearest_keyframes
from nscan_cli.slam.keyframes.route import Route


class OptimisationSchedule:
    """How much the graph has changed since it was optimised, in part and as a whole."""

    def __init__(self, options: ScheduleOptions) -> None:
        self.options = options
        self._moved, self._optimised, self._whole = 0.0, 0, 0

    def matched(self, moved: float) -> None:
        """Note that a match has moved a scan by this distance, m."""
        self._moved += moved

    def is_due(self, size: int) -> bool:
        """Whether a graph of `size` keyframes has changed enough to be optimised."""
        return (
            self._moved > self.options.min_motion
            and size - self._optimised >= self.options.min_new_share * size
        )

    def due(self, route: Route, relations: Sequence[Relation]) -> Subgraph:
        """The part of the graph to optimise then."""
        size, options = len(route.poses), self.options
        if size <= options.max_keyframes or size - self._whole >= options.whole_new_share * size:
            return Subgraph(relations)
        return held_by_others(
            route, relations, nearest_keyframes(route.poses, self._optimised, size, options.max_keyframes)
        )

    def optimised(self, size: int, part: Subgraph) -> None:
        """Note that a part of a graph of `size` keyframes has been optimised."""
        self._moved, self._optimised = 0.0, size
        if part.free is None:
            self._whole = size
