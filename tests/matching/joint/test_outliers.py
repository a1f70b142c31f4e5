from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from nscan_cli.matching.joint.joint_energy import Priors, all_pairs, no_priors
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.outliers import (
    CONTRADICTS_PRIORS,
    IN_NO_PAIR,
    OVERLAPS_NONE,
    outliers,
    squared_deviation,
    squared_deviations,
    too_far,
)
from nscan_cli.matching.joint.overlap import Overlaps
from nscan_cli.poses import Array, compose, relative
from tests.matching.problems import chain_priors

OPTIONS = JointOptions()
CERTAIN = np.tile(np.eye(3) * 1e12, (4, 1, 1))
"""Matches that leave nothing open."""
SIGMA = 0.05
POSES = np.array([[0.0, 0, 0], [1.0, 0, 0.4], [2.0, 0.5, -0.3], [2.5, 1.5, 2.0]])


def all_overlap(n: int) -> Overlaps:
    return Overlaps(0.8 * (1 - np.eye(n)), np.full(n, 0.8))


def information(seed: int) -> Array:
    """(3, 3), positive definite."""
    root = np.random.default_rng(seed).normal(size=(3, 3)) * [10, 20, 50]
    matrix: Array = root.T @ root + np.eye(3)
    return matrix


def deviation(pull: Array, prior: Array, match: Array) -> float:
    """Of one pose."""
    return float(squared_deviation(pull[None], prior[None], match[None])[0])


@pytest.mark.parametrize(("gap", "lost"), [(4.4, []), (4.6, [0]), (400.0, [0])])
def test_a_scan_that_can_meet_no_other_is_out_of_reach(gap, lost):
    """Points 5 m and 3 m away, whatever their direction: behind, they may be ahead if a start is turned."""
    points = [np.array([[-5.0, 0], [1, 0]]), np.array([[0, 3.0]]), np.array([[0, 2.0], [1, 0]])]
    start = np.array([[-(8.0 + gap), 0, 0], [0, 0, 1.0], [0, 0.5, 0]])
    assert too_far(points, start, 4.5) == lost


def test_a_scan_alone_meets_no_other():
    assert too_far([np.ones((3, 2))], np.zeros((1, 3)), 4.5) == [0]


@given(st.integers(0, 99), st.integers(0, 99))
def test_the_deviation_is_measured_by_both_uncertainties(a, b):
    prior, match = information(a), information(1000 + b)
    delta = np.random.default_rng(b).normal(size=3) * 0.1
    expected = delta @ np.linalg.solve(np.linalg.inv(prior) + np.linalg.inv(match), delta)
    assert deviation(prior @ delta, prior, match) == pytest.approx(expected, rel=1e-6)


def test_the_deviations_of_sound_scans_are_chi_squared():
    """Prior and match drawn about the truth as they say of themselves: 3 on average."""
    rng, found = np.random.default_rng(3), []
    prior, match = information(1), information(2)
    roots = [np.linalg.inv(np.linalg.cholesky(matrix)).T for matrix in (prior, match)]
    for _ in range(4000):
        mean, matched = (root @ rng.normal(size=3) for root in roots)
        found.append(deviation(prior @ (matched - mean), prior, match))
    assert np.mean(found) == pytest.approx(3, abs=0.15)
    assert 0 < np.mean(np.array(found) > chi2.ppf(0.999, 3)) < 0.003


def test_what_a_match_leaves_open_is_no_deviation():
    """A corridor along x: the match knows y and the angle only."""
    prior = np.diag([400.0, 400, 100])
    corridor = np.diag([0.0, 1e6, 1e6])
    assert deviation(prior @ np.array([5.0, 0, 0]), prior, corridor) == pytest.approx(0)
    assert deviation(prior @ np.array([0, 0.3, 0]), prior, corridor) == pytest.approx(36, rel=1e-3)


@given(st.integers(0, 99), st.floats(-3, 3), st.floats(-3, 3))
def test_one_prior_is_broken_as_much_for_either_scan(seed, turn, x):
    """It is the prior's own χ², in whatever frame the two scans lie."""
    rng = np.random.default_rng(seed)
    poses = compose(np.array([x, 1.0, turn]), rng.normal(size=(2, 3)))
    off, weight = rng.normal(size=3) * 0.3, information(seed)
    priors = Priors(np.array([[0, 1]]), (relative(poses[1], poses[0]) - off)[None], weight[None])
    expected = off @ weight @ off
    for found in squared_deviations(priors, poses, CERTAIN[:2] * 1e3):
        np.testing.assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize("wrong", [0, 1, 2, 3])
def test_a_scan_at_a_wrong_place_is_the_one_that_contradicts_its_priors(wrong):
    """0.4 m off by priors of 0.05 m: 64 a prior; the ends of the chain have one only."""
    poses = POSES.copy()
    poses[wrong, :2] += [0.4, 0]
    by_all, by_most = squared_deviations(chain_priors(POSES, SIGMA), poses, CERTAIN)
    assert by_most[wrong] == pytest.approx(64)
    assert by_all[wrong] == pytest.approx(128 if wrong in (1, 2) else 64)
    assert by_most[2 if wrong == 1 else 1 if wrong == 2 else 3 - wrong] == pytest.approx(0, abs=1e-6)
    out = outliers(all_overlap(4), all_pairs(4), chain_priors(POSES, SIGMA), poses, CERTAIN, OPTIONS)
    assert [(outlier.scan, outlier.overlap, outlier.chi2) for outlier in out] == [
        (wrong, 0.8, by_most[wrong])
    ]
    assert out[0].reason == f"{CONTRADICTS_PRIORS} (χ² 64.0, at most 16.27)"


def test_an_odometry_that_slipped_once_makes_no_outlier():
    """Between scans 1 and 2 it says 0.4 m too much; all other priors are met."""
    priors = chain_priors(POSES, SIGMA)
    priors.means[1, 0] += 0.4
    by_all, by_most = squared_deviations(priors, POSES, CERTAIN)
    assert by_all.max() > chi2.ppf(0.999, 3)
    assert by_most.max() < 1e-6
    assert outliers(all_overlap(4), all_pairs(4), priors, POSES, CERTAIN, OPTIONS) == []


def test_within_the_bounds_a_scan_stays():
    """√16.27 = 4.03 standard deviations."""
    for deviations, count in ((3.9, 0), (4.2, 1)):
        poses = POSES[:2] + np.array([[0.0, 0, 0], [0, deviations * SIGMA, 0]])
        assert (
            len(
                outliers(
                    all_overlap(2), all_pairs(2), chain_priors(POSES[:2], SIGMA), poses, CERTAIN[:2], OPTIONS
                )
            )
            == count
        )


def test_angles_are_compared_as_angles():
    poses = np.array([[0.0, 0, 3.1], [1.0, 0, -3.1]])
    priors = chain_priors(poses, SIGMA)
    priors.means[0, 2] += 2 * np.pi
    assert np.max(squared_deviations(priors, poses, CERTAIN[:2])) < 1e-6


def test_all_scans_that_overlap_none_go_before_any_bound_is_looked_at():
    shares = all_overlap(4)
    shares.pairs[[1, 3]] = shares.pairs[:, [1, 3]] = 0.02
    poses = POSES.copy()
    poses[0] += 5
    out = outliers(shares, all_pairs(4), chain_priors(POSES, SIGMA), poses, CERTAIN, OPTIONS)
    assert [(outlier.scan, outlier.reason, outlier.overlap, outlier.chi2) for outlier in out] == [
        (1, OVERLAPS_NONE, 0.02, None),
        (3, OVERLAPS_NONE, 0.02, None),
    ]


def test_a_scan_in_no_pair_is_left_out_though_it_overlaps():
    pairs = np.array([[0, 1], [1, 0], [1, 3], [3, 1]])
    out = outliers(all_overlap(4), pairs, no_priors(), POSES, CERTAIN, OPTIONS)
    assert [(outlier.scan, outlier.reason) for outlier in out] == [(2, IN_NO_PAIR)]
