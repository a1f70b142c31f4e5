from __future__ import annotations

import numpy as np

from nscan_cli.matching.pairwise import match_pair
from nscan_cli.matching.scan_pairs import match_scans
from nscan_cli.poses import relative
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


def test_along_a_corridor_a_second_match_ends_elsewhere():
    walls = np.concatenate([
        np.stack([np.linspace(-8.0, 8.0, 100), np.full(100, side)], axis=1) for side in (-1.0, 1.0)
    ])  # fmt: skip
    assert match_scans(walls, walls, np.zeros(3), OPTIONS, probe=0.2).apart > 0.1
