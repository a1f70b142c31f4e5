from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.load import read_log
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise import (
    NO_OVERLAP,
    STEP_LIMIT,
    PairMatch,
    match_pair,
    matched_points,
    scan_ndt,
)
from nscan_cli.matching.uncertainty import CELL_BORDER
from nscan_cli.ndt.energy import energy
from nscan_cli.poses import Array, relative, wrap
from tests.data import OFFICE_LOG
from tests.matching.problems import OPTIONS, fig_3, near, office_problem, office_truth, problem
from tests.ndt.transforms import gaussian_count
from tests.simulation.laser import Laser
from tests.simulation.scenes import corridor_and_room, office

ROWS = range(0, 2400, 100)


def pair_matches(noise: bool) -> list[tuple[PairMatch, Array]]:
    """Matches of scans four apart along the office's drive, and their errors (3,)."""
    both = tuple(row for first in ROWS for row in (first, first + 4))
    scans = office_problem(both, noise)
    found = []
    for at in range(0, len(both), 2):
        truth = relative(scans.truth[at + 1], scans.truth[at])
        start = near(truth[None], at, 0.1, 0.05)[0]
        match = match_pair(scans.ndts[at], scans.points[at + 1], start, None, OPTIONS)
        off = match.pose - truth
        off[2] = wrap(off[2])
        found.append((match, off))
    return found


def test_relative_poses_are_found_without_noise():
    """What is left is that two scans sample the same walls at other places: small against a cell of 1 m,
    and within the covariance of noisy scans (99 % of χ² with three degrees of freedom is 11.3).
    """
    matches = pair_matches(noise=False)
    distances = [float(np.hypot(*off[:2])) for _, off in matches]
    assert np.median(distances) < 0.003
    assert max(distances) < 0.05
    assert max(abs(off[2]) for _, off in matches) < 0.003
    for match, off in matches:
        assert match.covariance is not None
        assert off @ np.linalg.solve(match.covariance, off) < 11.3


def test_relative_poses_are_found_within_the_noise():
    """Errors against the match's own covariance: 99.9 % of χ² with three degrees of freedom is 16.3."""
    matches = pair_matches(noise=True)
    assert np.median([np.hypot(*off[:2]) for _, off in matches]) < 0.5 * Laser().noise
    for match, off in matches:
        assert match.overlap > 0.5
        assert match.covariance is not None
        assert off @ np.linalg.solve(match.covariance, off) < 16.3
        assert match.converged or match.reason == CELL_BORDER
    assert np.mean([match.converged for match, _ in matches]) > 0.9


def test_the_result_describes_the_objective_at_its_pose():
    scans = office_problem((300, 306))
    truth = relative(scans.truth[1], scans.truth[0])
    prior = Prior(truth + np.array([0.05, 0, 0]), np.diag([400.0, 400.0, 2500.0]))
    match = match_pair(scans.ndts[0], scans.points[1], truth, prior, OPTIONS)
    at_pose = energy(scans.ndts[0], scans.points[1], match.pose)
    assert match.energy == pytest.approx(at_pose.value)
    hessian = OPTIONS.scale * at_pose.hessian + prior.information
    gradient = OPTIONS.scale * at_pose.gradient + prior.information @ (match.pose - prior.mean)
    np.testing.assert_allclose(match.hessian, hessian, rtol=1e-9)
    assert match.gradient_norm == pytest.approx(np.linalg.norm(gradient), abs=1e-9)
    assert match.covariance is not None
    assert match.decrement is not None
    np.testing.assert_allclose(match.covariance @ hessian, np.eye(3), atol=1e-8)
    assert match.decrement == pytest.approx(np.sqrt(gradient @ np.linalg.solve(hessian, gradient)), rel=1e-6)
    np.testing.assert_allclose(match.eigenvalues, np.linalg.eigvalsh(hessian))


@pytest.mark.parametrize("heading", [0.0, 0.4, -2.0])
def test_the_weakest_direction_is_along_the_corridor(heading):
    """Two scans deep in the corridor, the far end out of reach: the walls say nothing of the way along."""
    scene = dataclasses.replace(corridor_and_room(), laser=Laser(beams=360, max_range=3.0))
    truth = np.array([[-7.0, 0.1, heading], [-6.5, -0.1, heading + 0.2]])
    scans = problem(scene, truth, noise=True)
    match = match_pair(scans.ndts[0], scans.points[1], relative(truth[1], truth[0]), None, OPTIONS)
    off = match.weakest.direction + heading
    assert abs(np.degrees((off + np.pi / 2) % np.pi - np.pi / 2)) < 3
    across = match.eigenvalues[1]
    assert match.weakest.sigma is None or match.weakest.sigma > 10 * across**-0.5


def test_a_pair_of_fig_3_leaves_the_corridor_open():
    scans = fig_3()
    match = match_pair(
        scans.ndts[0], scans.points[1], relative(scans.truth[1], scans.truth[0]), None, OPTIONS
    )
    assert abs(np.degrees(match.weakest.direction)) < 3
    assert match.weakest.sigma is None or match.weakest.sigma > 0.2


def test_a_prior_holds_what_the_scans_leave_open():
    scans = fig_3(noise=True)
    truth = relative(scans.truth[1], scans.truth[0])
    prior = Prior(truth, np.diag([100.0, 100.0, 400.0]))
    match = match_pair(scans.ndts[0], scans.points[1], truth, prior, OPTIONS)
    assert match.weakest.sigma is not None
    assert match.weakest.sigma < 0.11
    assert abs(match.pose[0] - truth[0]) < 0.2


def test_where_nothing_overlaps_the_match_says_so():
    scans = office_problem((0, 1))
    far = np.array([300.0, 0.0, 0.0])
    match = match_pair(scans.ndts[0], scans.points[1], far, None, OPTIONS)
    assert (match.converged, match.reason, match.overlap) == (False, NO_OVERLAP, 0.0)
    assert match.covariance is None
    assert match.decrement is None
    assert match.weakest.sigma is None
    np.testing.assert_allclose(match.pose, far)
    with_prior = match_pair(scans.ndts[0], scans.points[1], far, Prior(far, np.eye(3)), OPTIONS)
    assert with_prior.reason == NO_OVERLAP
    assert with_prior.covariance is not None
    np.testing.assert_allclose(with_prior.covariance, np.eye(3))


def test_too_few_steps_are_named():
    scans = office_problem((300, 306))
    start = relative(scans.truth[1], scans.truth[0]) + np.array([0.2, 0.1, 0.1])
    hurried = dataclasses.replace(OPTIONS, max_iterations=1)
    match = match_pair(scans.ndts[0], scans.points[1], start, None, hurried)
    assert match.reason == STEP_LIMIT
    assert (match.iterations, match.evaluations) == (3, 7)


def test_a_stage_that_is_cut_off_on_the_way_is_counted():
    """From this start, turned by 155°, the first stage circles; the match converges, and at a wrong place."""
    log = read_log(OFFICE_LOG)
    ndt, points = scan_ndt(matched_points(log, 553, OPTIONS), OPTIONS), matched_points(log, 567, OPTIONS)
    start = np.array([-0.4, 0.1, np.radians(155)])
    match = match_pair(ndt, points, start, None, OPTIONS)
    assert (match.converged, match.unsettled) == (True, 1)
    for options in (
        dataclasses.replace(OPTIONS, max_iterations=5000),
        dataclasses.replace(OPTIONS, widenings=OPTIONS.widenings[-1:]),
    ):
        assert match_pair(ndt, points, start, None, options).unsettled == 0


def test_a_border_that_holds_the_match_is_reported():
    """Some of many matches stop where the energy jumps, with a Newton step left that counts."""
    scans = office_problem(tuple(range(300, 2400, 12)))
    held = 0
    for at in range(len(scans) - 1):
        truth = relative(scans.truth[at + 1], scans.truth[at])
        match = match_pair(scans.ndts[at], scans.points[at + 1], truth, None, OPTIONS)
        if match.covariance is None or match.decrement is None:
            assert not match.converged
            continue
        at_pose = energy(scans.ndts[at], scans.points[at + 1], match.pose)
        left = match.covariance @ (OPTIONS.scale * at_pose.gradient)
        counts = match.decrement > 0.5 and np.abs(left).max() > 0.01
        held += match.reason == CELL_BORDER
        assert not (counts and match.converged)
        assert counts or match.reason != CELL_BORDER
    assert held > 0


def test_points_beyond_the_reach_are_left_out():
    scene = office()
    log = scene.record_at(office_truth()[:1], 1).log()
    near_by = dataclasses.replace(OPTIONS, reach=3.0)
    points = matched_points(log, 0, near_by)
    assert 3 <= len(points) < len(log.points(0))
    from_laser = np.linalg.norm(points - log.mount[:2], axis=1)
    assert from_laser.max() <= 3.0 + 1e-6


def test_a_scan_without_usable_beams_is_refused():
    log = office().record_at(office_truth()[:1], 1).log()
    with pytest.raises(InputDataError, match=r"office\.log: scan 0 has 0 usable beams within 0\.01 m"):
        matched_points(log, 0, dataclasses.replace(OPTIONS, reach=0.01))


def test_the_ndt_of_a_scan_is_compact():
    points = office_problem((0,)).points[0]
    ndt = scan_ndt(points, OPTIONS)
    assert len(ndt.grid.keys) == ndt.rows
    assert gaussian_count(ndt) > 10
