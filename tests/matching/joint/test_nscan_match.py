from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from nscan_cli.matching.joint import nscan_match as nscan_module
from nscan_cli.matching.joint.index_set import index_set
from nscan_cli.matching.joint.joint_energy import Priors, all_pairs, joint_energy, no_priors
from nscan_cli.matching.joint.nscan_match import nscan_match
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.outliers import CONTRADICTS_PRIORS, ONLY_ONE_LEFT, OVERLAPS_NONE, TOO_FAR
from nscan_cli.matching.joint.overlap import overlaps
from nscan_cli.matching.joint.scan_set import ScanSet, scan_set
from nscan_cli.ndt.energy import inlier_share
from nscan_cli.poses import Array, relative, relative_jacobians
from tests.matching.problems import OPTIONS, Problem, chain_priors, errors, fig_3, near, office_problem

ROWS = (2000, 2008, 2016, 2024)
FREE, FIXED = JointOptions(), JointOptions(fixed=0)


@pytest.fixture(scope="module")
def four() -> Problem:
    return office_problem(ROWS)


def none(_kept: Sequence[int]) -> Priors:
    return no_priors()


def chain(truth: Array, sigma: float) -> Callable[[Sequence[int]], Priors]:
    """Priors from each scan kept to the next, as true as `truth` (n, 3)."""
    return lambda kept: chain_priors(truth[list(kept)], sigma)


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
    shares = overlaps(four.joint().scans, four.truth, FREE.inlier_bound)
    seen = np.zeros((4, len(four.points[3])), dtype=bool)
    for i in range(4):
        for j in range(4):
            u = relative(four.truth[j], four.truth[i])
            expected = 0.0
            if i != j:
                grid, half = four.ndts[i].grid, four.ndts[i].half
                expected = inlier_share(grid, half, four.points[j], u, FREE.inlier_bound)
                if j == 3:
                    seen[i] = [
                        inlier_share(grid, half, p[None], u, FREE.inlier_bound) for p in four.points[3]
                    ]
            assert shares.pairs[i, j] == pytest.approx(expected)
    assert shares.scans[3] == pytest.approx(seen.any(axis=0).mean())


def test_scans_too_far_to_meet_any_are_left_out_before_the_match(four, monkeypatch):
    away = four.truth + np.array([[0.0, 0, 0], [400, 0, 0], [0, 0, 0], [0, 400, 0]])
    laid_out = []

    def counted(*parts: Any) -> ScanSet:
        laid_out.append(parts)
        return scan_set(*parts)

    monkeypatch.setattr(nscan_module, "scan_set", counted)
    match, left_out = nscan_match(four.points, away, none, 1, OPTIONS, FIXED)
    assert match is not None
    assert match.kept == (0, 2)
    assert [(out.scan, out.reason, out.overlap) for out in left_out] == [
        (1, TOO_FAR, 0.0),
        (3, TOO_FAR, 0.0),
    ]
    assert len(laid_out) == 1
    # The scan to be held is gone: the first one left takes its place.
    assert match.fixed == 0
    np.testing.assert_array_equal(match.joint.poses[0], away[0])
    assert len(match.overlap) == len(match.weakest) == 2
    assert match.joint.hessian.shape == (6, 6)


@pytest.mark.parametrize("pairs", ["all", "visible", "overlap"])
def test_scans_that_overlap_none_are_left_out_and_the_rest_is_matched(four, pairs):
    """Scan 1 begins where the others could meet it, if it were elsewhere."""
    away = four.truth + np.array([[0.0, 0, 0], [0, 18, 1.5], [0, 0, 0], [0, 0, 0]])
    match, left_out = nscan_match(four.points, away, none, 0, OPTIONS, FREE, pairs)
    assert match is not None
    assert [(out.scan, out.reason) for out in left_out] == [(1, OVERLAPS_NONE)]
    assert left_out[0].overlap < 0.1
    assert match.kept == (0, 2, 3)
    assert match.reason is None
    assert np.abs(errors(match.joint.poses, four.truth[[0, 2, 3]])[:, :2]).max() < 0.03


def test_a_scan_out_of_the_bounds_of_its_priors_is_left_out(four):
    """Where the priors put scan 2 half a metre elsewhere, only scan 2 goes, not its neighbours."""
    expected = four.truth.copy()
    expected[2, :2] += 0.5
    match, left_out = nscan_match(four.points, four.truth, chain(expected, 0.05), 0, OPTIONS, FREE)
    assert match is not None
    assert [out.scan for out in left_out] == [2]
    assert left_out[0].reason.startswith(CONTRADICTS_PRIORS)
    assert left_out[0].chi2 == pytest.approx(0.5 / 0.05**2, rel=0.05)
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
    assert left_out[0].reason.startswith(CONTRADICTS_PRIORS)
    assert left_out[1].reason == ONLY_ONE_LEFT


def test_the_index_set_is_chosen_at_the_poses():
    """From a room into the corridor: not all scans have something in common."""
    ten = office_problem(tuple(range(0, 400, 40)))
    start = near(ten.truth, 1)
    kept = {}
    for kind in ("all", "visible", "overlap"):
        match, left_out = nscan_match(ten.points, start, chain(ten.truth, 0.2), 0, OPTIONS, FREE, kind)
        assert match is not None
        assert not left_out
        chosen = index_set(kind, FREE.index_set, ten.joint().scans, match.joint.poses)
        np.testing.assert_array_equal(match.pairs, chosen)
        assert np.abs(errors(match.joint.poses, ten.truth)[:, :2]).max() < 0.1
        # E is that of the pairs.
        alone = joint_energy(ten.joint(pairs=match.pairs, scale=1.0), match.joint.poses)
        assert match.energy == pytest.approx(alone.value)
        kept[kind] = len(match.pairs)
    assert kept["all"] == 90
    assert max(kept["visible"], kept["overlap"]) < 60
    default, _ = nscan_match(ten.points, start, chain(ten.truth, 0.2), 0, OPTIONS, FREE)
    assert default is not None
    assert len(default.pairs) == kept["overlap"]


def pair_in_a_corridor() -> Problem:
    """Scans 1 and 2 of the paper's Fig. 3: all that both see are the walls of a corridor along x."""
    three = fig_3(noise=True)
    return Problem(three.truth[:2], three.points[:2], three.ndts[:2])


def test_a_scan_held_through_a_corridor_only_is_kept_and_its_weak_direction_named(four):
    pair = pair_in_a_corridor()
    match, left_out = nscan_match(pair.points, near(pair.truth, 1), chain(pair.truth, 0.2), 0, OPTIONS, FREE)
    assert match is not None
    assert not left_out
    assert abs(errors(match.joint.poses, pair.truth)[1, 1]) < 0.05
    for weakest in match.weakest:
        assert weakest.is_weak
        assert abs(weakest.direction - match.joint.poses[0, 2]) < np.radians(5)
    rooms, _ = nscan_match(four.points, near(four.truth, 1), none, 0, OPTIONS, FREE)
    assert rooms is not None
    assert all(weakest.sigma is not None and weakest.sigma < 0.02 for weakest in rooms.weakest)
    assert not any(weakest.is_weak for weakest in rooms.weakest)


@pytest.mark.parametrize(("shift", "count"), [((1.0, 0, 0), 0), ((0, 1.0, 0), 1)], ids=["along", "across"])
def test_along_a_corridor_no_scan_is_out_of_bounds(shift, count):
    """The match knows the way across it, where the priors are 5 standard deviations off, and not along."""
    pair = pair_in_a_corridor()
    priors = chain(pair.truth + np.array([[0, 0, 0], shift]), 0.2)
    _, left_out = nscan_match(pair.points, pair.truth, priors, 0, OPTIONS, FREE)
    assert len([out for out in left_out if out.reason.startswith(CONTRADICTS_PRIORS)]) == count


def test_the_covariance_does_not_depend_on_the_scan_that_is_held(four):
    """That of any relative pose is the same, whichever scan the covariance is relative to, in both gauges."""
    start, found = near(four.truth, 5), []
    for fixed in range(4):
        for gauge in (FREE, JointOptions(fixed=fixed)):
            match, _ = nscan_match(four.points, start, none, fixed, OPTIONS, gauge)
            assert match is not None
            assert match.covariance is not None
            whole = np.zeros((12, 12))
            others = np.delete(np.arange(12), np.arange(3 * fixed, 3 * fixed + 3))
            whole[np.ix_(others, others)] = match.covariance
            jacobian, poses = np.zeros((3, 12)), match.joint.poses
            jacobian[:, 9:], jacobian[:, 3:6] = relative_jacobians(poses[3], poses[1])
            found.append(jacobian @ whole @ jacobian.T)
    scale = np.sqrt(np.outer(np.diag(found[0]), np.diag(found[0])))
    for covariance in found[1:]:
        np.testing.assert_allclose(covariance / scale, found[0] / scale, atol=0.1)
