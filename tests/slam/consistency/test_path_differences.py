"""Differences of two paths over ways of some length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.poses import compose
from nscan_cli.slam.consistency.options import VerificationOptions
from nscan_cli.slam.consistency.path_differences import path_differences
from nscan_cli.slam.consistency.repeated_maps import MappedPath

OPTIONS = VerificationOptions(ways=(1.0, 5.0))


def path(poses: np.ndarray, every: int = 1, breaks: tuple[int, ...] = ()) -> MappedPath:
    rows = np.arange(0, len(poses), every)
    return MappedPath(rows, poses[rows], np.array(breaks, dtype=np.int64), ())


def straight(count: int = 101, step: float = 0.1) -> np.ndarray:
    return np.stack([step * np.arange(count), np.zeros(count), np.zeros(count)], axis=1)


def test_where_the_frame_lies_does_not_matter():
    found = path_differences(path(straight()), path(compose(np.array([3.0, -2.0, 1.0]), straight())), OPTIONS)
    assert [each.way for each in found] == [1.0, 5.0]
    assert max(each.max for each in found) < 1e-9


def test_a_slip_is_found_at_its_place():
    slipped = straight()
    slipped[60:, 0] += 0.4
    one, five = path_differences(path(straight()), path(slipped, every=2), OPTIONS)
    assert one.max == pytest.approx(0.4)
    assert five.max == pytest.approx(0.4)
    assert one.median == pytest.approx(0.0, abs=1e-9)
    assert one.first < 60 <= one.last


def test_a_break_says_nothing():
    broken = straight()
    broken[50:] = compose(np.array([30.0, 5.0, 2.0]), broken[50:])
    found = path_differences(path(straight()), path(broken, breaks=(50,)), OPTIONS)
    assert [each.max for each in found] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_ways_over_a_gap_are_left_out():
    """The scans of the repeat are 0.6 m apart: it may be lost."""
    assert path_differences(path(straight(step=0.3)), path(straight(step=0.3), every=2), OPTIONS) == []


def test_no_way_is_so_long():
    (one,) = path_differences(path(straight(30)), path(straight(30)), OPTIONS)
    assert one.way == 1.0
    assert path_differences(path(straight(1)), path(straight(1)), OPTIONS) == []


def test_what_the_repeat_alone_guesses_says_nothing():
    slipped = straight()
    slipped[:60, 0] -= 0.4
    repeat = replace(path(slipped), degenerate=np.array([58, 59, 60, 61]))
    assert max(each.max for each in path_differences(path(straight()), repeat, OPTIONS)) < 1e-9
    # A map that guesses there as well may be wrong.
    guess = replace(path(straight()), degenerate=np.array([57, 58, 59, 60, 61]))
    assert path_differences(guess, repeat, OPTIONS)[0].max == pytest.approx(0.4)


def test_a_robot_that_stands_goes_no_way():
    """It trembles by 5 mm, 7 m in all; and the repeat has somebody who passes move it by 0.4 m."""
    stands = np.zeros((1000, 3))
    stands[:, :2] = 0.005 * np.random.default_rng(1).standard_normal((1000, 2))
    moved = stands.copy()
    moved[500:600, 0] += 0.4
    assert path_differences(path(stands), path(moved), OPTIONS) == []
