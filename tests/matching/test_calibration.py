"""The covariance of a joint match against its errors, over matches of scans with the noise drawn anew."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nscan_cli.matching.joint import JointOptions
from nscan_cli.matching.joint_energy import Priors
from nscan_cli.matching.nscan import nscan_match
from nscan_cli.matching.pairwise import PairOptions, matched_points
from nscan_cli.matching.priors import MotionModel, odometry_prior
from nscan_cli.poses import compose, relative, wrap
from tests.matching.problems import office_truth
from tests.simulation.scenes import office

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
    truth, n = office_truth()[list(rows)], len(rows)
    options, fixed = PairOptions(), len(rows) // 2
    errors = []
    for seed in range(DRAWS):
        log = office().record_at(truth, seed).log()
        odometry = log.odometry
        assert odometry is not None

        def priors_among(kept, odometry=odometry):
            steps = [
                odometry_prior(odometry[a], odometry[b], MotionModel()) for a, b in itertools.pairwise(kept)
            ]
            pairs = np.stack([np.arange(len(kept) - 1), np.arange(1, len(kept))], axis=1)
            return Priors(pairs, np.array([s.mean for s in steps]), np.array([s.information for s in steps]))

        points = [matched_points(log, row, options) for row in range(n)]
        match, left_out = nscan_match(points, odometry.copy(), priors_among, fixed, options, JointOptions())
        assert match is not None
        assert not left_out
        assert match.covariance is not None
        # The error in the frame that the covariance is given in: that of the local poses.
        poses = match.joint.poses
        true = compose(poses[fixed], relative(truth, truth[fixed]))
        off = poses - true
        off[:, 2] = wrap(off[:, 2])
        error = np.delete(off, fixed, axis=0).ravel()
        errors.append(error @ np.linalg.solve(match.covariance, error) / len(error))
    assert 0.5 < np.mean(errors) < 2
