from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from nscan_cli.matching.joint import JointOptions
from nscan_cli.matching.joint_energy import Priors, all_pairs, joint_energy, no_priors
from nscan_cli.matching.nscan import BREAKS_BOUNDS, OVERLAPS_NONE, nscan_match
from nscan_cli.matching.overlap import INLIER_BOUND, overlaps
from nscan_cli.ndt.energy import inlier_share
from nscan_cli.poses import relative
from tests.matching.problems import OPTIONS, Problem, errors, near, office_problem

ROWS = (2000, 2008, 2016, 2024)
FREE, FIXED = JointOptions(), JointOptions(fixed=0)


@pytest.fixture(scope="module")
def four() -> Problem:
    return office_problem(ROWS)


def none(_kept: Sequence[int]) -> Priors:
    return no_priors()


def chain(truth, sigma: float):
    """Priors from each scan kept to the next, as true as `truth` (n, 3)."""

    def among(kept: Sequence[int]) -> Priors:
        pairs = [(at, at + 1) for at in range(len(kept) - 1)]
        means = [relative(truth[kept[b]], truth[kept[a]]) for a, b in pairs]
        information = np.tile(np.eye(3) * sigma**-2, (len(pairs), 1, 1))
        return Priors(np.array(pairs, dtype=np.int64).reshape(-1, 2), np.array(means), information)

    return among


def test_scans_that_belong_together_are_all_kept(four):
    match, left_out = nscan_match(four.points, near(four.truth, 1), none, 1, OPTIONS, FREE)
    assert match is not None
    assert (match.kept, match.fixed, match.reason, left_out) == ((0, 1, 2, 3), 1, None, [])
    assert match.pairs.tolist() == all_pairs(4).tolist()
    assert np.abs(errors(match.joint.poses, four.truth)[:, :2]).max() < 0.03
    alone = joint_energy(four.joint(scale=1.0), match.joint.poses)
    assert match.energy == pytest.approx(alone.value)
    assert match.overlap.min() > 0.6
    others = [0, 1, 2, 6, 7, 8, 9, 10, 11]
    assert match.covariance is not None
    np.testing.assert_allclose(
        match.covariance @ match.joint.hessian[np.ix_(others, others)], np.eye(9), atol=1e-6
    )


def test_a_fixed_gauge_holds_the_scan_that_was_named(four):
    start = near(four.truth, 2)
    match, _ = nscan_match(four.points, start, none, 2, OPTIONS, FIXED)
    assert match is not None
    np.testing.assert_array_equal(match.joint.poses[2], start[2])


def test_overlaps_count_points_on_gaussians(four):
    shares = overlaps(four.joint().scans, four.truth)
    seen = np.zeros((4, len(four.points[3])), dtype=bool)
    for i in range(4):
        for j in range(4):
            u = relative(four.truth[j], four.truth[i])
            expected = 0.0
            if i != j:
                grid, half = four.ndts[i].grid, four.ndts[i].half
                expected = inlier_share(grid, half, four.points[j], u, INLIER_BOUND)
                if j == 3:
                    seen[i] = [inlier_share(grid, half, p[None], u, INLIER_BOUND) for p in four.points[3]]
            assert shares.pairs[i, j] == pytest.approx(expected)
    assert shares.scans[3] == pytest.approx(seen.any(axis=0).mean())


def test_scans_that_overlap_none_are_left_out_and_the_rest_is_matched(four):
    away = four.truth + np.array([[0.0, 0, 0], [400, 0, 0], [0, 0, 0], [0, 400, 0]])
    match, left_out = nscan_match(four.points, away, none, 1, OPTIONS, FIXED)
    assert match is not None
    assert match.kept == (0, 2)
    assert [(out.scan, out.reason, out.overlap) for out in left_out] == [
        (1, OVERLAPS_NONE, 0.0),
        (3, OVERLAPS_NONE, 0.0),
    ]
    # The scan to be held is gone: the first one left takes its place.
    assert match.fixed == 0
    np.testing.assert_array_equal(match.joint.poses[0], away[0])
    assert len(match.overlap) == 2
    assert match.joint.hessian.shape == (6, 6)


def test_a_scan_that_breaks_its_priors_is_left_out(four):
    """Where the priors put scan 2 half a metre elsewhere, only scan 2 goes, not its neighbours."""
    expected = four.truth.copy()
    expected[2, :2] += 0.5
    match, left_out = nscan_match(four.points, four.truth, chain(expected, 0.05), 0, OPTIONS, FREE)
    assert match is not None
    assert [(out.scan, out.reason) for out in left_out] == [(2, BREAKS_BOUNDS)]
    assert left_out[0].overlap > 0.5
    assert match.kept == (0, 1, 3)
    assert np.abs(errors(match.joint.poses, four.truth[[0, 1, 3]])[:, :2]).max() < 0.05


def test_when_no_two_scans_match_there_is_no_relation(four):
    away = four.truth + np.array([[0.0, 0, 0], [400, 0, 0], [0, 400, 0], [400, 400, 0]])
    match, left_out = nscan_match(four.points, away, none, 0, OPTIONS, FREE)
    assert match is None
    assert [out.scan for out in left_out] == [0, 1, 2, 3]


def test_two_scans_that_break_their_prior_are_no_relation(four):
    expected = four.truth[:2] + np.array([[0.0, 0, 0], [0.0, 0.7, 0]])
    match, left_out = nscan_match(four.points[:2], four.truth[:2], chain(expected, 0.05), 0, OPTIONS, FREE)
    assert match is None
    assert {out.scan for out in left_out} == {0, 1}
    assert left_out[0].reason == BREAKS_BOUNDS
