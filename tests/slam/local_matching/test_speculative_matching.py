"""Matches made ahead of their turn: which, and when they count. Whole runs are compared in test_pipeline."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from nscan_cli.graph.model import Pairwise
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.slam.frontend.tracked_scans import TrackedScan
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import Route, extended, route_of
from nscan_cli.slam.local_matching.coverage import Coverage
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.local_matching.speculative_matching import MATCHES_AHEAD, SpeculativeMatching

OPTIONS = NScanOptions(radius=2.5)
"""Two keyframes to both sides of one are near."""
SIZE = 20
NEAR = Neighbours(np.arange(4, 9), np.zeros(5, dtype=np.bool_), 0)
"""Those near keyframe 6."""


def keyframe(k: int) -> Keyframe:
    """The k-th, 1 m further along a straight line."""
    tracked = TrackedScan(np.array([k, 0.0, 0.0]), np.eye(3), np.eye(3), 1.0, float(k), True)
    return Keyframe(k, tracked, np.eye(3), np.empty((0, 2)), 0, GaussianOptions(), [])


def straight(size: int) -> Route:
    """A route of the first of twenty keyframes, so many."""
    keyframes = [keyframe(k) for k in range(SIZE)]
    step = np.array([1.0, 0.0, 0.0])
    chain = [Pairwise((k, k + 1), step, np.eye(3), "track") for k in range(SIZE - 1)]
    return extended(route_of(keyframes, chain, np.zeros((1, 3))), size)


class Matches:
    """In place of real matches: who was asked for what."""

    def __init__(self) -> None:
        self.made: list[tuple[int, int, int]] = []
        """Thread, centre and size of the route."""
        self.aside: list[tuple[int, float]] = []
        """Centre, and y of keyframe 9."""

    def __call__(
        self, route: Route, centre: int, near: Neighbours, options: NScanOptions
    ) -> LocalMatch | None:
        self.made.append((threading.get_ident(), centre, len(route.poses)))
        self.aside.append((centre, route.poses[9, 1]))
        return LocalMatch((), None, None, float(centre), True)


def begin(ahead: SpeculativeMatching, route: Route) -> None:
    """What comes after the match of keyframe 6 with its neighbours."""
    ahead.begin(route, SIZE, 6, NEAR, Coverage())


def asked(ahead: SpeculativeMatching, route: Route, centre: int) -> LocalMatch | None:
    """The match about a keyframe at its turn."""
    return ahead.match(route, centre, choose_neighbours(route.poses, route.paths, centre, OPTIONS))


def test_what_is_due_next_is_begun_as_if_every_match_related_all():
    """Around 6 all pairs of 4 to 8 are: keyframe 7 misses one of its four (with 9), 8 two (9 and 10)."""
    matches, route = Matches(), straight(10)
    with SpeculativeMatching(matches, OPTIONS, 2) as ahead:
        ahead.open()
        begin(ahead, route)
        begin(ahead, route)
        ahead.settle()
    begun = [(centre, size) for _, centre, size in matches.made]
    # Each with the route as it will be at its turn, three keyframes further than the centre.
    assert begun == [(8, 12), (10, 14)]
    assert len(begun) == MATCHES_AHEAD


def test_a_match_counts_if_the_graph_lies_as_it_was_assumed():
    matches, route = Matches(), straight(10)
    with SpeculativeMatching(matches, OPTIONS, 2) as ahead:
        ahead.open()
        begin(ahead, route)
        ahead.settle()
        longer = extended(route, 12)
        found = asked(ahead, longer, 8)
        assert found is not None
        assert found.moved == 8.0
        assert [centre for _, centre, _ in matches.made] == [8, 10]
        moved = extended(longer, 14)
        moved.poses[3, 0] += 1e-12
        asked(ahead, moved, 10)
    assert [centre for _, centre, _ in matches.made] == [8, 10, 10]
    assert matches.made[-1][0] == threading.get_ident() != matches.made[0][0]


def test_what_the_graph_has_left_behind_is_begun_anew():
    matches, route = Matches(), straight(10)
    with SpeculativeMatching(matches, OPTIONS, 2) as ahead:
        ahead.open()
        begin(ahead, route)
        route.poses[9, 1] = 0.5
        begin(ahead, route)
        ahead.settle()
    # As the graph lies now, whatever had been made before it moved.
    assert matches.aside[-2:] == [(8, 0.5), (10, 0.5)]


def test_with_one_thread_or_before_it_is_opened_none_is_begun():
    for threads in (1, 2):
        matches, route = Matches(), straight(10)
        with SpeculativeMatching(matches, OPTIONS, threads) as ahead:
            if threads == 1:
                ahead.open()
            begin(ahead, route)
            assert matches.made == []
            ahead.match(route, 6, NEAR)
        assert [centre for _, centre, _ in matches.made] == [6]


def test_in_the_end_what_was_begun_is_there_or_made_and_no_more_is_begun():
    matches, route = Matches(), straight(10)
    with SpeculativeMatching(matches, OPTIONS, 2) as ahead:
        ahead.open()
        begin(ahead, route)
    begin(ahead, route)
    for centre, size in ((8, 12), (10, 14)):
        found = asked(ahead, extended(route, size), centre)
        assert found is not None
        assert found.moved == centre
    assert sorted(centre for _, centre, _ in matches.made) == [8, 10]


def test_an_error_is_raised_at_its_turn():
    def fail(route: Route, centre: int, near: Neighbours, options: NScanOptions) -> LocalMatch | None:
        raise ZeroDivisionError

    route = straight(10)
    with SpeculativeMatching(fail, OPTIONS, 2) as ahead:
        ahead.open()
        begin(ahead, route)
        with pytest.raises(ZeroDivisionError):
            asked(ahead, extended(route, 12), 8)


def test_who_waits_for_a_match_makes_the_next_one():
    """Keyframe 8 is done when 10 is: with each thread idle while the other works, that would be never."""
    made: dict[int, int] = {}
    begun, done = threading.Event(), threading.Event()

    def match(route: Route, centre: int, near: Neighbours, options: NScanOptions) -> LocalMatch | None:
        assert centre not in made
        made[centre] = threading.get_ident()
        if centre == 10:
            done.set()
        else:
            begun.set()
            assert done.wait(60)
        return LocalMatch((), None, None, float(centre), True)

    route = straight(10)
    with SpeculativeMatching(match, OPTIONS, 2) as ahead:
        ahead.open()
        begin(ahead, route)
        assert begun.wait(60)
        for centre, size in ((8, 12), (10, 14)):
            found = asked(ahead, extended(route, size), centre)
            assert found is not None
            assert found.moved == centre
    assert made[10] == threading.get_ident() != made[8]
