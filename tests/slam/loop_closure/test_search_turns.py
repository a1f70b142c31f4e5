"""Pieces of a map among which a keyframe is searched that may be anywhere: few at once, none forgotten."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.poses import Indices
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.search_turns import SearchTurns

EACH = 4
"""Keyframes of a piece."""


def pieces_of(count: int) -> list[Indices]:
    return [np.arange(EACH * k, EACH * (k + 1)) for k in range(count)]


@given(count=st.integers(0, 30), most=st.integers(1, 8))
def test_each_piece_has_its_turn_and_no_keyframe_is_searched_among_more(count, most):
    options = LoopClosureOptions(max_lost_searches=most)
    turns, pieces, rounds = SearchTurns(options), pieces_of(count), -(-count // most)
    for path in range(3):
        searched: list[int] = []
        for step in range(rounds):
            now = turns.next(pieces)
            assert len(now) == min(count, most)
            assert now == sorted(now)
            searched += now
            for which in now:
                turns.took(pieces[which], 3.0 * (path * rounds + step), found=False)
        assert set(searched) == set(range(count))


def test_where_something_was_found_it_is_searched_again_until_others_wait_for_too_long():
    options = LoopClosureOptions(max_lost_searches=1)
    turns, pieces, paths = SearchTurns(options), pieces_of(3), np.arange(0.0, 200.0, options.search_interval)
    searched = []
    for path in paths.tolist():
        (which,) = turns.next(pieces)
        searched.append(which)
        turns.took(pieces[which], path, found=which == 1)
    assert searched[:4] == [0, 1, 2, 1]
    for which in (0, 2):
        waits = np.diff(paths[np.array(searched) == which])
        assert waits.max() <= options.agreement_path + 2 * options.search_interval
    assert searched.count(1) > 0.7 * len(searched)


def test_a_piece_that_grew_is_next():
    turns, pieces = SearchTurns(LoopClosureOptions(max_lost_searches=1)), pieces_of(2)
    turns.took(pieces[0], 0.0, found=False)
    turns.took(pieces[1], 3.0, found=False)
    assert turns.next(pieces) == [0]
    assert turns.next([pieces[0], np.arange(EACH, 2 * EACH + 1)]) == [1]
