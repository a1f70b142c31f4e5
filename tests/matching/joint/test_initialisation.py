from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.joint import initialisation
from nscan_cli.matching.joint.initialisation import match_or_search
from nscan_cli.matching.joint.joint_match import match_near_and_far
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.poses import Array, compose, relative
from tests.matching.problems import OPTIONS, Problem, errors, near, office_problem


@pytest.fixture(scope="module")
def five() -> Problem:
    """Five scans in and about a door."""
    return office_problem((2000, 2008, 2016, 2024, 2032))


def astray(truth: Array, seed: int) -> Array:
    """Starts that are 1.2 m and 25° off, each."""
    rng = np.random.default_rng(seed)
    where, sign = rng.uniform(0, 2 * np.pi, len(truth)), rng.choice([-1, 1], len(truth))
    off: Array = np.stack([1.2 * np.cos(where), 1.2 * np.sin(where), np.radians(25) * sign], axis=1)
    return truth + off


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scans_are_found_where_their_starts_lead_nowhere(five, seed):
    start, joint = astray(five.truth, seed), five.joint(scale=2 * OPTIONS.scale / 5)
    alone = match_near_and_far(joint, start, JointOptions())
    assert np.abs(errors(alone.poses, five.truth)[:, :2]).max() > 0.5
    match, _ = match_or_search(joint, five.points, start, OPTIONS, JointOptions())
    assert match.searched
    assert match.converged
    assert np.abs(errors(match.poses, five.truth)[:, :2]).max() < 0.03
    assert match.evaluations > alone.evaluations


def test_a_good_start_needs_no_search(five, monkeypatch):
    monkeypatch.setattr(initialisation, "Initialisation", None)
    joint = five.joint(scale=2 * OPTIONS.scale / 5)
    match, _ = match_or_search(joint, five.points, near(five.truth, 1), OPTIONS, JointOptions())
    assert not match.searched
    assert np.abs(errors(match.poses, five.truth)[:, :2]).max() < 0.03


@pytest.mark.parametrize("fixed", [None, 0, 3])
def test_the_frame_stays_that_of_the_start(five, fixed):
    """The scan that is held does not move; with a free gauge, the scans as a whole do not."""
    start = compose(np.array([40.0, -7.0, 2.0]), astray(five.truth, 1))
    joint = five.joint(scale=2 * OPTIONS.scale / 5)
    match, _ = match_or_search(joint, five.points, start, OPTIONS, JointOptions(fixed=fixed))
    assert match.searched
    if fixed is None:
        off = match.poses - start
        assert np.abs(off[:, :2].mean(axis=0)).max() < 0.05
    else:
        np.testing.assert_allclose(match.poses[fixed], start[fixed], atol=1e-9)


def test_what_hangs_no_better_together_is_not_taken():
    """Scans of two rooms with a wall between: no place that a search finds holds them together."""
    apart = office_problem((60, 72, 2000, 2012))
    joint = apart.joint(scale=2 * OPTIONS.scale / 4)
    start = relative(apart.truth, apart.truth[0])
    match, _ = match_or_search(joint, apart.points, start, OPTIONS, JointOptions())
    assert not match.searched
