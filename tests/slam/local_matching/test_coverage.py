"""Which pairs of keyframes have been matched, and that the loop makes no match twice over."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.coverage import Coverage
from nscan_cli.slam.local_matching.joint_relations import LocalMatch
from nscan_cli.slam.local_matching.neighbours import choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.options import SlamOptions
from tests.logs.excerpts import excerpt
from tests.slam.mapped_logs import Mapped, mapped, mapped_office, office_log


def joint(*nodes: int) -> LocalMatch:
    """A joint match that related some nodes."""
    size = len(nodes)
    relation = NScan(nodes, np.zeros((size, 3)), np.zeros((3 * size, 3 * size)), 0, "nscan")
    return LocalMatch((), relation, None, 0.0, True)


def single(*pairs: tuple[int, int]) -> LocalMatch:
    """Single matches."""
    relations = tuple(Pairwise(pair, np.zeros(3), np.eye(3), "track") for pair in pairs)
    return LocalMatch(relations, None, None, 0.0, True)


def test_nothing_is_covered_at_first_and_a_keyframe_alone_always():
    covered = Coverage()
    assert covered.share(3, [1, 2, 3, 4]) == 0.0
    assert covered.share(3, [3]) == 1.0
    assert covered.share(3, []) == 1.0


def test_a_joint_match_covers_all_its_pairs_and_a_refused_one_those_of_its_centre():
    """Golden: the centre 5 was tried with 2, 7 and 9, and the match kept 2, 5 and 7."""
    covered = Coverage()
    covered.add(5, [2, 5, 7, 9], joint(2, 5, 7))
    assert covered.share(5, [2, 5, 7, 9]) == 1.0
    # 2 and 7 were related; nobody tried 2 or 7 with 9.
    assert covered.share(2, [5, 7, 9]) == 2 / 3
    assert covered.share(7, [2, 5, 9]) == 2 / 3
    assert covered.share(9, [2, 5, 7]) == 1 / 3
    refused = Coverage()
    refused.add(5, [2, 5, 7, 9], None)
    assert refused.share(5, [2, 5, 7, 9]) == 1.0
    assert refused.share(2, [5, 7, 9]) == 1 / 3


def test_single_matches_cover_what_they_relate_either_way_round():
    covered = Coverage()
    covered.add(5, [9], single((2, 5), (7, 5)))
    assert [covered.share(a, [b]) for a, b in ((2, 5), (5, 2), (5, 7), (7, 5), (9, 5), (2, 7))] == [1] * 5 + [
        0
    ]


@given(
    st.lists(
        st.tuples(st.integers(0, 8), st.sets(st.integers(0, 8)), st.sets(st.integers(0, 8))), max_size=5
    ),
    st.integers(0, 8),
    st.sets(st.integers(0, 8)),
)
def test_the_share_is_that_of_the_pairs_in_some_match(matches, centre, others):
    covered = Coverage()
    for about, tried, kept in matches:
        covered.add(about, sorted(tried), joint(*kept) if kept else None)

    def matched(a: int, b: int) -> bool:
        return any(
            (a == about and b in tried) or (b == about and a in tried) or {a, b} <= kept
            for about, tried, kept in matches
        )

    pairs = [matched(centre, other) for other in others if other != centre]
    assert covered.share(centre, others) == (sum(pairs) / len(pairs) if pairs else 1.0)


def seven_rounds(of: int) -> Route:
    """Seven times the same way of so many keyframes, 2 m apart."""
    k = np.arange(7 * of)
    poses = np.stack([2.0 * (k % of), np.zeros(len(k)), np.zeros(len(k))], axis=1)
    return Route([], 10 * k, [], 30.0 * (k // of) + 2.0 * k, poses)


def due(route: Route, covered: Coverage, centre: int) -> bool:
    options = NScanOptions()
    near = choose_neighbours(route.poses, route.paths, centre, options)
    return covered.is_due(route, centre, near, options)


@pytest.mark.parametrize(("round_", "after"), [(0, 1), (1, 1), (2, 5), (6, 5)])
def test_from_the_third_visit_on_one_match_a_window_is_due(round_, after):
    """After a joint match that closes a loop: it has places for five keyframes of a visit."""
    route, covered = seven_rounds(40), Coverage()
    first = 40 * round_ + 10
    closed = NScan((10 * first,), np.zeros((1, 3)), np.zeros((3, 3)), 0, "loop")
    covered.add(10 * first, [], LocalMatch((), closed, None, 0.0, True))
    assert [due(route, covered, first + k) for k in range(1, 6)] == [k >= after for k in range(1, 6)]
    assert due(route, covered, first - 4) == (after == 1)


def test_a_match_that_closes_no_loop_spares_none():
    route, covered = seven_rounds(40), Coverage()
    covered.add(10 * 210, [], joint(10 * 210))
    assert due(route, covered, 211)
    covered.add(10 * 210, [], None)
    assert due(route, covered, 211)


def test_what_is_assumed_counts_and_leaves_the_coverage_beneath_as_it_was():
    route, covered = seven_rounds(40), Coverage()
    above, options = Coverage(beneath=covered), NScanOptions()
    near = choose_neighbours(route.poses, route.paths, 210, options)
    above.assume(route, 210, near)
    assert above.share(10 * 210, (10 * near.members).tolist()) == 1.0
    assert not due(route, above, 212)
    assert due(route, covered, 212)
    over = Coverage(beneath=above)
    assert not due(route, over, 212)
    assert over.share(10 * 210, (10 * near.members).tolist()) == 1.0


def centres(run: Mapped) -> set[int]:
    return {relation.nodes[relation.fixed] for relation in run.graph.nscan}


def test_keyframes_that_others_cover_are_no_centres():
    """Along 30 m. A share that is never reached makes each the centre of a match, as there were no others.

    Of those with the same neighbours, some near its ends, one is.
    """
    log, options = excerpt(office_log(), slice(0, 300)), SlamOptions()
    always = dataclasses.replace(options, nscan=NScanOptions(max_covered_share=1.1))
    sparse, dense = mapped(log, options), mapped(log, always)
    keyframes = dense.graph.keyframes
    assert len(centres(dense)) > 0.6 * len(keyframes)
    assert len(centres(sparse)) < 0.5 * len(keyframes)
    off = sparse.graph.poses - dense.graph.poses
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.03


def test_yet_each_keyframe_is_a_centre_or_others_hold_its_pairs():
    """From the final poses: what the last pass left out was held by the relations that are in the graph.

    A few had a match of the same keyframes as another, which is made once, and have moved since.
    """
    office = mapped_office(True)
    keyframes, options = office.state.keyframes.list, office.state.options.nscan
    rows = [keyframe.row for keyframe in keyframes]
    paths = np.array([keyframe.tracked.path for keyframe in keyframes])
    covered = Coverage()
    for relation in office.graph.nscan:
        covered.add(relation.nodes[relation.fixed], [], joint(*relation.nodes))
    shares = np.zeros(len(rows))
    for k in range(len(rows)):
        near, *_ = choose_neighbours(office.state.poses, paths, k, options)
        shares[k] = covered.share(rows[k], [rows[other] for other in near])
    assert (shares > 0).all()
    held = (shares >= options.max_covered_share) | np.isin(rows, list(centres(office)))
    assert held.mean() > 0.96
    assert (shares[~held] > 0.4).all()
