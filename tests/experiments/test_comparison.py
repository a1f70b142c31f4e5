from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import wrap
from tests.experiments.comparison import CHAIN, ENOUGH, NSCAN, PAIRS, compare
from tests.experiments.drawing import SIZES, Drawn, draw_simulated
from tests.simulation.scenes import office

COUNT = 16


@pytest.fixture(scope="module")
def drawn() -> list[Drawn]:
    return draw_simulated(office(), COUNT, 7)


def test_starts_are_off_by_what_was_drawn(drawn):
    assert [len(problem.points) for problem in drawn] == [*SIZES, *SIZES]
    for problem in drawn:
        off = problem.start - problem.truth
        np.testing.assert_allclose(np.hypot(off[:, 0], off[:, 1]), problem.error)
        # 2° at 0.1 m, 30° at 1.5 m.
        degrees = 2 + 28 * (problem.error - 0.1) / 1.4
        np.testing.assert_allclose(np.degrees(np.abs(wrap(off[:, 2]))), degrees)
        assert 0.1 <= problem.error <= 1.5


def test_the_drawing_is_fixed_by_its_seed(drawn):
    again, other = draw_simulated(office(), 3, 7), draw_simulated(office(), 3, 8)
    for first, second, third in zip(drawn, again, other, strict=False):
        np.testing.assert_array_equal(first.start, second.start)
        np.testing.assert_array_equal(first.points[0], second.points[0])
        assert first.error != third.error


def test_joint_matching_solves_more_than_pairs(drawn):
    results = compare(drawn)
    enough = np.array([problem.link >= ENOUGH for problem in drawn])
    assert enough.sum() >= COUNT // 2
    for other in (CHAIN, PAIRS):
        assert results.solved[NSCAN].sum() > results.solved[other].sum()
        assert np.median(results.off[NSCAN]) < 0.8 * np.median(results.off[other])
    # Of what the pairs do not solve, though the scans overlap enough, more than half.
    failed = enough & np.logical_not(results.solved[PAIRS])
    assert results.solved[NSCAN][failed].mean() > 0.5
