"""Step 3 ahead of its turn: another thread makes the next matches, assuming that the graph does not move.

At its turn a match counts only if its input is still the same. So the graph is the same with any number of
threads.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from types import TracebackType
from typing import NamedTuple

import numpy as np

from nscan_cli.slam.keyframes.route import Route, extended
from nscan_cli.slam.local_matching.coverage import Coverage
from nscan_cli.slam.local_matching.joint_relations import LocalMatch, LocalMatcher
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.threads import completed_call

MATCHES_AHEAD = 2
"""Number of matches that are begun ahead of their turn; it changes no result."""


class _Begun(NamedTuple):
    route: Route
    """What it is made with."""
    near: Neighbours
    match: Future[LocalMatch | None]


class SpeculativeMatching:
    """Matches about the next keyframes, made ahead in another thread. A context manager; none begins before
    `open`."""

    def __init__(self, match: LocalMatcher, options: NScanOptions, threads: int) -> None:
        self._match, self._options, self._threads = match, options, threads
        self._pool: ThreadPoolExecutor | None = None
        self._begun: dict[int, _Begun] = {}

    def open(self) -> None:
        """Begin matches from now on: tracking no longer needs the other thread."""
        self._pool = ThreadPoolExecutor(1) if self._threads > 1 else None

    def match(self, route: Route, centre: int, near: Neighbours) -> LocalMatch | None:
        """The match of keyframe `centre` with its neighbours, whether it has been begun or not."""
        begun = self._begun.pop(centre, None)
        # What waits still is as well made here.
        if begun is None or not np.array_equal(begun.route.poses, route.poses) or begun.match.cancel():
            return self._match(route, centre, near, self._options)
        if not begun.match.done():
            self._make_next()
        return begun.match.result()

    def _make_next(self) -> None:
        """Make the first match that waits, while another one is being made."""
        for keyframe, (route, near, match) in self._begun.items():
            if match.cancel():
                made = completed_call(partial(self._match, route, keyframe, near, self._options))
                self._begun[keyframe] = _Begun(route, near, made)
                return

    def settle(self) -> None:
        """Wait until all matches that have been begun are made."""
        wait([begun.match for begun in self._begun.values()])

    def begin(self, route: Route, whole: int, centre: int, near: Neighbours, covered: Coverage) -> None:
        """Begin the matches that follow the one of keyframe `centre`.

        The first `whole` keyframes of the route have all their scans; those that are not in the graph yet
        join it next. Every match is assumed to relate all its members.
        """
        if self._pool is None:
            return
        assumed = Coverage(beneath=covered)
        assumed.assume(route, centre, near)
        self._drop_outdated(route, centre)
        for other, begun in self._begun.items():
            assumed.assume(begun.route, other, begun.near)
        behind = self._options.centre_delay
        following = range(max([centre, *self._begun]) + 1, max(whole, len(route.poses)) - behind)
        for keyframe in following:
            if len(self._begun.keys() - {centre}) >= MATCHES_AHEAD:
                return
            longer = extended(route, keyframe + behind + 1)
            near = choose_neighbours(longer.poses, longer.paths, keyframe, self._options)
            if assumed.is_due(longer, keyframe, near, self._options):
                assumed.assume(longer, keyframe, near)
                match = self._pool.submit(self._match, longer, keyframe, near, self._options)
                self._begun[keyframe] = _Begun(longer, near, match)

    def _drop_outdated(self, route: Route, centre: int) -> None:
        """Drop the matches of the past, and those that were begun before the graph moved."""
        for keyframe, begun in list(self._begun.items()):
            if keyframe < centre or not np.array_equal(begun.route.poses[: len(route.poses)], route.poses):
                begun.match.cancel()
                del self._begun[keyframe]

    def __enter__(self) -> SpeculativeMatching:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=kind is not KeyboardInterrupt, cancel_futures=True)
            self._pool = None
