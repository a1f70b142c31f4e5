"""Step 3: which keyframes take part in the match of one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.poses import Array
from nscan_cli.slam.local_matching.neighbours import choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions

OPTIONS = NScanOptions(max_scans=6, radius=5.0, visit_path=20.0)


def along(*x: float) -> Array:
    """Poses on a line."""
    return np.stack([np.array(x), np.zeros(len(x)), np.zeros(len(x))], axis=1)


def test_visits_are_parts_of_the_path_that_came_by_before():
    """Four times along 20 m, from one time to the next 100 m of path; keyframes 2 m apart."""
    k = np.arange(44)
    poses = np.stack([2.0 * (k % 11), np.zeros(44), np.zeros(44)], axis=1)
    paths = (100.0 * (k // 11) + poses[:, 0]).astype(np.float64)
    assert [choose_neighbours(poses, paths, centre, OPTIONS).visits for centre in (5, 16, 27, 38)] == [
        0,
        1,
        2,
        3,
    ]
    assert choose_neighbours(poses, paths, 38, dataclasses.replace(OPTIONS, loops=False)).visits == 0


def test_of_other_visits_the_first_take_part():
    """Six times along the same way, a little nearer each time."""
    k = np.arange(66)
    poses = np.stack([2.0 * (k % 11), 0.01 * (5.0 - k // 11), np.zeros(66)], axis=1)
    paths = (100.0 * (k // 11) + poses[:, 0]).astype(np.float64)

    def visits_beside(centre: int, options: NScanOptions) -> set[int]:
        near = choose_neighbours(poses, paths, centre, options)
        return set((near.members[near.from_other_visit] // 11).tolist())

    all_of_them = dataclasses.replace(OPTIONS, max_other_visits=99)
    assert visits_beside(60, all_of_them) == {2, 3, 4}
    assert visits_beside(60, OPTIONS) == {0, 1, 2}
    assert visits_beside(60, dataclasses.replace(OPTIONS, max_other_visits=1)) == {0}
    # Those that come later count, too, where there are not so many before.
    assert visits_beside(5, OPTIONS) == {1, 2, 3}
    assert visits_beside(16, OPTIONS) == {0, 2, 3}


def test_the_nearest_within_the_radius_are_chosen_in_order_of_time():
    poses = along(7, 4, 3, 2, 1, 0, -1, -2, 0)
    chosen, seen, _ = choose_neighbours(poses, np.arange(9.0), 8, dataclasses.replace(OPTIONS, radius=3.0))
    assert (chosen.tolist(), seen.tolist()) == ([3, 4, 5, 6, 7, 8], [False] * 6)
    chosen, *_ = choose_neighbours(poses, np.arange(9.0), 8, dataclasses.replace(OPTIONS, radius=1.0))
    assert chosen.tolist() == [4, 5, 6, 8]


def test_keyframes_after_the_centre_take_part_and_are_of_another_visit_when_far_along_the_path():
    poses, paths = along(0, 1, 2, 0.1, 0.2), np.array([0.0, 1, 2, 3, 30])
    chosen, seen, _ = choose_neighbours(poses, paths, 2, OPTIONS)
    assert (chosen.tolist(), seen.tolist()) == ([0, 1, 2, 3, 4], [False] * 4 + [True])


def test_without_loops_other_visits_leave_their_places_to_this_one():
    poses = along(2.0, 2.1, *(0.1 * np.arange(8)[::-1]), 2.2)
    paths = np.array([0.0, 0.1, *(50 + np.arange(8)), 100])
    chosen, seen, _ = choose_neighbours(poses, paths, 9, OPTIONS)
    assert (chosen.tolist(), seen.tolist()) == ([0, 1, 7, 8, 9, 10], [True, True, False, False, False, True])
    chosen, seen, _ = choose_neighbours(poses, paths, 9, dataclasses.replace(OPTIONS, loops=False))
    assert (chosen.tolist(), seen.tolist()) == ([4, 5, 6, 7, 8, 9], [False] * 6)


@pytest.mark.parametrize(
    ("old", "recent", "chosen_old", "chosen_recent"),
    [(5, 5, 3, 3), (1, 8, 1, 5), (8, 1, 5, 1), (0, 9, 0, 6), (2, 3, 2, 3), (6, 3, 3, 3)],
)
def test_half_of_the_places_are_kept_for_what_was_seen_before(old, recent, chosen_old, chosen_recent):
    """The old ones are farther than all recent ones, and yet three come in; the rest fills up."""
    poses = along(*(2 + 0.1 * np.arange(old)), *(0.1 * np.arange(recent)[::-1]))
    paths = np.concatenate([np.arange(old) * 0.1, 50 + np.arange(recent) * 0.1])
    chosen, seen, _ = choose_neighbours(poses, paths, old + recent - 1, OPTIONS)
    assert (seen == (chosen < old)).all()
    assert (chosen < old).sum() == chosen_old
    assert (chosen >= old).sum() == chosen_recent
    # Of each kind those nearest: the first old ones, the last recent ones.
    expected = [*range(chosen_old), *range(old + recent - chosen_recent, old + recent)]
    assert chosen.tolist() == expected


@given(st.integers(1, 40), st.integers(0, 10**6), st.integers(3, 12), st.booleans())
@settings(max_examples=100, deadline=None)
def test_what_is_chosen_is_near_not_too_much_and_has_the_centre(count, seed, most, loops):
    rng = np.random.default_rng(seed)
    poses, paths = rng.uniform(-5, 5, (count, 3)), np.cumsum(rng.uniform(0, 3, count))
    centre = int(rng.integers(count))
    options = dataclasses.replace(OPTIONS, max_scans=most, loops=loops)
    chosen, seen, _ = choose_neighbours(poses, paths, centre, options)
    assert centre in chosen
    assert (np.diff(chosen) > 0).all()
    near = np.hypot(*(poses[:, :2] - poses[centre, :2]).T) <= 5
    old = np.abs(paths - paths[centre]) > 20
    assert near[chosen].all()
    assert (seen == old[chosen]).all()
    if loops:
        assert len(chosen) == min(most, near.sum())
        assert seen.sum() >= min((near & old).sum(), most // 2)
    else:
        assert len(chosen) == min(most, (near & ~old).sum())
        assert not seen.any()
