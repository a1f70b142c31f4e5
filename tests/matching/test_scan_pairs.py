from __future__ import annotations

import numpy as np

from nscan_cli.matching.pairwise import match_pair
from nscan_cli.matching.scan_pairs import match_scans
from nscan_cli.poses import Array, relative
from tests.matching.problems import OPTIONS, near, office_problem

ROWS = (0, 4, 700, 704, 1500, 1504, 2000, 2004)


def test_a_match_in_one_call_is_that_of_match_pair():
    scans = office_problem(ROWS, noise=True)
    for at in range(0, len(ROWS), 2):
        start = near(relative(scans.truth[at + 1], scans.truth[at])[None], at, 0.1, 0.05)[0]
        reference, points = scans.points[at], scans.points[at + 1]
        wanted = match_pair(scans.ndts[at], points, start, None, OPTIONS)
        found = match_scans(reference, points, start, OPTIONS, probe=0.05)
        np.testing.assert_allclose(found.pose, wanted.pose, atol=1e-9)
        np.testing.assert_allclose(found.information, wanted.hessian, rtol=1e-6)
        assert found.converged
        assert abs(found.overlap - wanted.overlap) < 1e-12
        assert found.apart < 0.01


def test_from_a_near_start_a_match_without_the_first_stage_ends_within_the_noise():
    scans = office_problem((700, 704), noise=True)
    truth = relative(scans.truth[1], scans.truth[0])
    whole, near_start = (
        match_scans(scans.points[0], scans.points[1], truth, OPTIONS, is_near=is_near)
        for is_near in (False, True)
    )
    np.testing.assert_allclose(near_start.pose, whole.pose, atol=0.005)


def bare_walls(rng: np.random.Generator) -> Array:
    """Points (200, 2) on two walls, anywhere along them."""
    walls = [np.column_stack([rng.uniform(-8.0, 8.0, 100), np.full(100, side)]) for side in (-1.0, 1.0)]
    return np.concatenate(walls) + [0.0, 0.01] * rng.normal(size=(200, 2))


def test_along_a_corridor_a_second_match_ends_elsewhere():
    """Mostly: where it ends is chance, in the ripple of the points of bare walls."""
    draws = [np.random.default_rng(seed) for seed in range(15)]
    pairs = [(bare_walls(rng), bare_walls(rng)) for rng in draws]
    apart = [match_scans(*pair, np.zeros(3), OPTIONS, probe=0.2).apart for pair in pairs]
    assert np.median(apart) > 0.05
