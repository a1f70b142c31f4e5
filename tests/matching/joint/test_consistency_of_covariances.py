"""The covariance of a joint match against its errors, over matches of scans with the noise drawn anew."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.joint.joint_energy import Priors
from nscan_cli.matching.joint.nscan_match import NScanMatch, nscan_match
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.motion_model import MotionModel, odometry_prior
from nscan_cli.matching.pairwise import PairOptions, matched_points
from nscan_cli.poses import Array, compose, relative, wrap
from tests.matching.problems import office_truth
from tests.simulation.scenes import bare_corridor, office

DRAWS = 50


@pytest.mark.parametrize(
    "rows",
    [
        pytest.param((300, 306), id="two in a corridor with doors"),
        pytest.param(range(60, 90, 6), id="five while turning in a room"),
        pytest.param(range(200, 260, 6), id="ten on the way out of a room"),
        pytest.param(range(1000, 1025, 5), id="five along a corridor"),
    ],
)
def test_errors_are_as_large_as_the_covariance_says(rows):
    """The mean normalised error squared lies within 0.5 to 2 of its degrees of freedom; 200 matches."""
    truth = office_truth()[list(rows)]
    errors = []
    for seed in range(DRAWS):
        log = office().record_at(truth, seed).log()
        assert log.odometry is not None
        match = matched(log, log.odometry)
        errors.append(normalised_error(match, truth))
    assert 0.5 < np.mean(errors) < 2


@pytest.mark.parametrize(("n", "draws"), [(3, 100), (5, 100)])
def test_a_corridor_without_doors_leaves_the_way_along_it_to_the_odometry(n, draws):
    """Scans half a metre apart, the odometry as wrong as the motion model says: it is all that is known."""
    errors, along = [], []
    for seed in range(draws):
        random = np.random.default_rng(seed)
        truth = np.stack(
            [0.5 * np.arange(n), random.uniform(-0.2, 0.2, n), random.uniform(-0.1, 0.1, n)], axis=1
        )
        odometry = [truth[0]]
        for a, b in itertools.pairwise(truth):
            prior = odometry_prior(a, b, MotionModel())
            step = prior.mean + random.normal(0, np.diag(prior.information) ** -0.5)
            odometry.append(compose(odometry[-1], step))
        match = matched(bare_corridor().record_at(truth, seed).log(), np.array(odometry))
        if match.covariance is None:
            # The little that is known along is noise, and may curve the wrong way: said, and rare.
            assert match.reason is not None
            continue
        errors.append(normalised_error(match, truth))
        along.append(min(weakest.sigma or np.inf for weakest in match.weakest))
    assert len(errors) >= 0.95 * draws
    assert 0.5 < np.mean(errors) < 2
    assert np.median(along) > 0.05


def matched(log: LaserLog, odometry: Array) -> NScanMatch:
    """All scans of a log matched jointly, from the odometry and with it as priors."""

    def priors_among(kept: Sequence[int]) -> Priors:
        steps = [odometry_prior(odometry[a], odometry[b], MotionModel()) for a, b in itertools.pairwise(kept)]
        pairs = np.stack([np.arange(len(kept) - 1), np.arange(1, len(kept))], axis=1)
        return Priors(pairs, np.array([s.mean for s in steps]), np.array([s.information for s in steps]))

    n, options = len(odometry), PairOptions()
    points = [matched_points(log, row, options) for row in range(n)]
    match, left_out = nscan_match(points, odometry.copy(), priors_among, n // 2, options, JointOptions())
    assert match is not None
    assert not left_out
    return match


def normalised_error(match: NScanMatch, truth: Array) -> float:
    """The error squared in units of the covariance, per degree of freedom."""
    assert match.covariance is not None
    # The error in the frame that the covariance is given in: that of the local poses.
    poses, fixed = match.poses, match.fixed
    true = compose(poses[fixed], relative(truth, truth[fixed]))
    off = poses - true
    off[:, 2] = wrap(off[:, 2])
    error = np.delete(off, fixed, axis=0).ravel()
    return float(error @ np.linalg.solve(match.covariance, error) / len(error))
