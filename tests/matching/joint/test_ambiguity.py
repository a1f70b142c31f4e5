"""How far off scans fit elsewhere, and what a Hessian is left to know of that."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from nscan_cli.matching.joint.ambiguity import with_ambiguity
from nscan_cli.matching.joint.gauge import gauge_directions
from nscan_cli.matching.joint.joint_energy import JointProblem, Priors
from nscan_cli.matching.joint.joint_match import JointMatch, match_jointly
from nscan_cli.matching.joint.options import AmbiguityOptions, JointOptions
from nscan_cli.poses import Array, relative
from tests.matching.problems import Problem, errors, office_problem, problem
from tests.simulation.laser import Laser
from tests.simulation.scenes import Scene
from tests.simulation.world import Builder

OPTIONS = AmbiguityOptions()
APART = 1.0
"""m from pier to pier."""
CHI2_OF_THREE = 16.27
"""99.9 %"""
SHORT = Laser(361, -np.pi, np.radians(1.0), 4.0, noise=0.02)
"""Sees no farther than a few of them."""
TRUTH = np.array([(0.0, 0.0, 0.0), (0.7, 0.1, 0.1)])
"""Two scans of the same stretch."""


def piers_alike() -> Scene:
    """A corridor with a pier every metre, on both sides: it fits onto itself a metre farther on."""
    plan = Builder()
    for side in (-1.0, 1.0):
        plan.line(-30.0, 1.1 * side, 30.0, 1.1 * side)
        for x in np.arange(-30.0, 30.0, APART):
            plan.box(float(x), side - 0.1, float(x) + 0.15, side + 0.1)
    return Scene("piers_alike", plan.world(), np.array([(-20.0, 0.0), (20.0, 0.0)]), laser=SHORT)


@functools.cache
def corridor() -> Problem:
    return problem(piers_alike(), TRUTH, noise=True)


def matched(case: JointProblem, start: Array) -> tuple[JointMatch, Array]:
    """A match, and its Hessian where the scans may fit elsewhere."""
    match = match_jointly(case, start, JointOptions())
    assert match.converged
    return match, with_ambiguity(case, match.poses, match.hessian, OPTIONS)


def sigma_along(hessian: Array) -> float:
    """Standard deviation (m) of the second scan along x."""
    return float(np.linalg.inv(hessian[3:, 3:])[0, 0] ** 0.5)


def test_where_all_is_known_well_nothing_changes():
    office = office_problem((1000, 1005, 1010, 1015))
    match, less = matched(office.joint(), office.truth)
    assert less is match.hessian


@pytest.mark.parametrize("scale", [0.01, 0.03])
def test_a_pier_farther_on_is_known_to_be_possible(scale):
    match, less = matched(corridor().joint(scale=scale), TRUTH)
    assert sigma_along(match.hessian) < 0.1
    assert APART / 3 < sigma_along(less) < OPTIONS.distance
    # Across and in rotation it is known as well as before.
    before, after = (np.linalg.inv(each[3:, 3:]).diagonal()[1:] ** 0.5 for each in (match.hessian, less))
    assert (after < 1.5 * before).all()


def test_one_pier_off_the_truth_is_possible():
    """The scans fit there as well; by the Hessian alone the truth would be excluded."""
    match, less = matched(corridor().joint(scale=0.02), TRUTH + np.array([[0.0], [APART]]) * np.eye(3)[0])
    off = errors(match.poses, TRUTH).ravel()
    assert off[3] == pytest.approx(APART, abs=0.1)
    assert off @ match.hessian @ off > 300.0
    assert off @ less @ off < CHI2_OF_THREE


def test_a_prior_that_knows_the_way_leaves_nothing_open():
    """An odometry excludes what lies a pier farther on."""
    priors = Priors(np.array([[0, 1]]), relative(TRUTH[1:], TRUTH[0]), np.diag([1e4, 1e4, 1e4])[None])
    match, less = matched(corridor().joint(scale=0.02, priors=priors), TRUTH)
    assert sigma_along(less) < 2.0 * sigma_along(match.hessian)


def test_all_that_is_known_of_other_motions_stays():
    """What is lost is never more than was known, and nothing is known of where the scans lie as a whole."""
    several = problem(piers_alike(), np.array([(0.5 * k, 0.05 * k, 0.1 * k) for k in range(6)]), noise=True)
    match, less = matched(several.joint(scale=0.02), several.truth)
    lost = np.linalg.eigvalsh(match.hessian - less)
    assert np.count_nonzero(lost > 1e-6 * lost[-1]) in range(1, OPTIONS.motions + 1)
    assert lost[0] > -1e-9 * lost[-1]
    before, after = (np.linalg.eigvalsh(each[3:, 3:]) for each in (match.hessian, less))
    assert 0.0 < after[0] < before[0]
    gauge = gauge_directions(match.poses)
    assert np.abs((match.hessian - less) @ gauge).max() < 1e-3 * lost[-1]


def test_the_variance_of_a_motion_is_added():
    """C + variance · v vᵗ, by Sherman and Morrison, with the first scan where it is."""
    match, less = matched(corridor().joint(scale=0.02), TRUTH)
    added = np.linalg.inv(less[3:, 3:]) - np.linalg.inv(match.hessian[3:, 3:])
    values, vectors = np.linalg.eigh(added)
    assert np.abs(values[:-1]).max() < 1e-3 * values[-1]
    assert np.abs(vectors[0, -1]) > 0.99
    assert APART / 3 < values[-1] ** 0.5 < OPTIONS.distance


def test_scans_that_nothing_holds_are_left_as_they_are():
    """No variance can be added to an infinite one."""
    case, hessian = corridor().joint(), np.zeros((6, 6))
    assert with_ambiguity(case, TRUTH, hessian, OPTIONS) is hessian


def test_what_the_hessian_knows_better_than_a_centimetre_and_a_half_is_believed():
    match, less = matched(corridor().joint(scale=1.0), TRUTH)
    assert sigma_along(match.hessian) < OPTIONS.least_sigma
    assert less is match.hessian
