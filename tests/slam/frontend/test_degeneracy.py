"""Step 1 without odometry: where a scan does not tell its way along, the robot goes on as it did."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.matching.motion_model import Prior
from nscan_cli.ndt.energy import energy
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, wrap
from nscan_cli.slam.frontend.degeneracy import (
    distance_ahead,
    keep_prediction,
    measured_variance,
    objective_profile,
    weakest_direction,
)
from nscan_cli.slam.frontend.options import TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from tests.benchmarks.laser_kinds import WAY, turning
from tests.benchmarks.lasers import rms
from tests.logs.excerpts import truth_of
from tests.ndt.wall_points import room
from tests.simulation.building import building, drive
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.scenes import Scene
from tests.simulation.world import Builder
from tests.slam.frontend.test_tracker import end_off
from tests.slam.mapped_logs import mapped, poses_of, tracked

SETTINGS = TrackingParameters.of(TrackingOptions())
OPTIONS = SETTINGS.options.degeneracy
SIGMA = 0.3
"""m; of steady motion."""
EXPECTED = Prior(np.array([0.11, 0.0, 0.0]), np.diag([SIGMA**-2, SIGMA**-2, SIGMA**-2]))
PLACES: Array = OPTIONS.profile_step * np.arange(-25.0, 26.0)
"""2.5 standard deviations are 0.75 m."""
numbers = st.floats(-3, 3)


def corridor(seed: int, count: int, end: float | None = None) -> Array:
    """(m, 2) points of two walls, 2.2 m apart, that go on out of sight; at `end` (m) there may be another."""
    rng = np.random.default_rng(seed)
    walls = [np.stack([rng.uniform(-10, 10, count), np.full(count, side)], axis=1) for side in (-1.1, 1.1)]
    if end is not None:
        # At 6 m it fills 21° of the view: a fifth of the beams to one side.
        walls.append(np.stack([np.full(count // 5, end), rng.uniform(-1.1, 1.1, count // 5)], axis=1))
    points = np.concatenate(walls)
    return points + rng.normal(0, 0.015, points.shape)


def ndt_of(points: Array) -> Ndt:
    ndt = Ndt.empty(GaussianOptions(0.5, 5, 0.03), faces=False)
    ndt.add(points, np.zeros(3))
    return ndt


def matched(ndt: Ndt, points: Array, start: Array) -> TrackedScans:
    """One scan, matched from a start (3,)."""
    found = TrackedScans.room(1)
    found.poses[0] = start
    found.values[0], found.inliers[0] = match_and_count(
        ndt.grid, SETTINGS, points, EXPECTED, found.poses[0], found.hessians[0]
    )
    return found


@settings(deadline=None)
@given(st.lists(numbers, min_size=9, max_size=9))
def test_the_weakest_direction_is_that_of_the_greatest_covariance_whatever_the_angle(entries):
    root = np.array(entries).reshape(3, 3)
    H = root @ root.T + 0.1 * np.eye(3)
    along = np.empty(2)
    share = weakest_direction(H, along)
    information = np.linalg.inv(np.linalg.inv(H)[:2, :2])
    low, high = np.linalg.eigvalsh(information)
    assert share == pytest.approx(low / high, rel=1e-6, abs=1e-9)
    assert np.hypot(*along) == pytest.approx(1)
    assert along @ information @ along == pytest.approx(low, rel=1e-6, abs=1e-8 * high)


@pytest.mark.parametrize("pose", [(0.05, 0.02, 0.03), (0.3, -0.1, np.pi - 0.01)])
def test_the_profile_is_the_objective_along_a_line(pose):
    """Against E by its own function and (14) written out."""
    ndt, points, pose = ndt_of(room(1)), room(2), np.array(pose)
    prior = EXPECTED._replace(mean=np.array([0.1, 0.05, -np.pi + 0.02]))
    along = np.array([np.cos(0.4), np.sin(0.4)])
    places, values = objective_profile(ndt.grid, SETTINGS, points, prior, pose, along)
    np.testing.assert_allclose(places, PLACES, atol=1e-12)
    for place, value in zip(places, values, strict=True):
        there = pose.copy()
        there[:2] += (place - (pose - prior.mean)[:2] @ along) * along
        assert distance_ahead(there, prior, along) == pytest.approx(place, abs=1e-12)
        off = there - prior.mean
        off[2] = wrap(off[2])
        expected = (
            SETTINGS.options.scale * energy(ndt, points, there).value + 0.5 * off @ prior.information @ off
        )
        assert value == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("deviation", [0.08, 0.15])
@pytest.mark.parametrize("centre", [0.0, 0.2])
def test_what_a_scan_tells_is_what_the_prior_does_not(deviation, centre):
    """A product of two Gaussians: the one that is not the prior comes out again."""
    assert pytest.approx(PLACES[-1]) == OPTIONS.profile_sigmas * SIGMA
    values = 0.5 * (PLACES / SIGMA) ** 2 + 0.5 * ((PLACES - centre) / deviation) ** 2
    assert measured_variance(PLACES, values, EXPECTED, OPTIONS.profile_step) == pytest.approx(
        deviation**2, rel=0.1
    )
    nothing = measured_variance(PLACES, 0.5 * (PLACES / SIGMA) ** 2, EXPECTED, OPTIONS.profile_step)
    assert nothing > 1e3


def test_along_a_corridor_a_scan_stays_where_it_is_expected():
    """Wherever the ripple of the energy led it; across and in its angle it stays as it was matched."""
    ndt, points = ndt_of(corridor(1, 1000)), corridor(2, 100)
    for start in (-0.1, 0.0, 0.1, 0.25):
        found = matched(ndt, points, np.array([start, 0.0, 0.0]))
        before, unsteady = found.poses[0].copy(), np.array([OPTIONS.initial_sigma**2])
        keep_prediction(ndt.grid, SETTINGS, points, EXPECTED, unsteady, found, 0)
        # Two thirds of what the match moved it are taken back, or more.
        assert abs(found.poses[0, 0] - 0.11) < 0.4 * abs(before[0] - 0.11) + 1e-3
        np.testing.assert_allclose(found.poses[0, 1:], before[1:], atol=2e-3)
        assert unsteady[0] == OPTIONS.initial_sigma**2


@pytest.mark.parametrize("end", [5.0, 6.0])
def test_with_its_end_in_sight_a_scan_is_where_it_is_matched(end):
    """Wherever it was expected: off by 16 cm, or by 9."""
    ndt, points = ndt_of(corridor(1, 1000, end)), corridor(2, 100, end)
    for true in (-0.05, 0.0, 0.2):
        seen = points - np.array([true, 0.0])
        found = matched(ndt, seen, np.array([true + 0.03, 0.0, 0.0]))
        unsteady = np.array([OPTIONS.initial_sigma**2])
        keep_prediction(ndt.grid, SETTINGS, seen, EXPECTED, unsteady, found, 0)
        np.testing.assert_allclose(found.poses[0], [true, 0.0, 0.0], atol=0.02)


def test_a_place_that_fits_better_is_found_though_it_is_far_from_where_the_match_began():
    """A robot that has stood, and is 0.5 m on with the next scan: no widened Gaussian leads there."""
    ndt, points = ndt_of(corridor(1, 1000, 6.0)), corridor(2, 100, 6.0) - np.array([0.5, 0.0])
    found = matched(ndt, points, np.array([0.0, 0.0, 0.0]))
    found.poses[0] = 0.0
    found.values[0] = SETTINGS.options.scale * energy(ndt, points, np.zeros(3)).value
    keep_prediction(ndt.grid, SETTINGS, points, EXPECTED, np.array([OPTIONS.initial_sigma**2]), found, 0)
    np.testing.assert_allclose(found.poses[0], [0.5, 0.0, 0.0], atol=0.03)


def test_scans_that_tell_teach_how_steady_the_robot_goes():
    ndt, points, unsteady = ndt_of(room(1)), room(1), np.array([OPTIONS.initial_sigma**2])
    found = matched(ndt, points, np.zeros(3))
    before = found.poses[0].copy()
    keep_prediction(ndt.grid, SETTINGS, points, EXPECTED, unsteady, found, 0)
    np.testing.assert_array_equal(found.poses[0], before)
    off = before[:2] - EXPECTED.mean[:2]
    assert unsteady[0] == pytest.approx(
        (1 - OPTIONS.smoothing) * OPTIONS.initial_sigma**2 + OPTIONS.smoothing * 0.5 * off @ off
    )


def into_a_bare_corridor(seed: int) -> LaserLog:
    """28 m along a corridor without odometry; the last 12 have two walls and nothing else."""
    floor = Builder()
    for side in (-1.1, 1.1):
        floor.line(-60, side, 60, side)
    for x in (-17.1, -13.1, -9.7, -6.8, -2.9):
        floor.box(x, 0.9, x + 0.3, 1.1)
    scene = Scene("into_bare", floor.world(), np.array([(-18.0, 0.0), (10.0, 0.0)]))
    return dataclasses.replace(scene.record(seed).log(), odometry=None)


@pytest.mark.parametrize("seed", [4, 5])
def test_from_a_corridor_with_piers_into_a_bare_one(seed):
    """Ten of the last 12 m were lost before."""
    log = into_a_bare_corridor(seed)
    found, _ = tracked(log)
    end = end_off(poses_of(found), truth_of(log))
    assert abs(end[0]) < 1.0
    assert abs(end[1]) < 0.1


LASERS = {
    "91 beams": (Laser(91, -np.pi / 2, np.radians(2), 20.0), Drive()),
    "noise of 5 cm": (Laser(noise=0.05), Drive()),
    "6 m": (turning(360, 6.0, 0.03, 0.05), Drive(period=0.18)),
}


@pytest.mark.parametrize("laser", list(LASERS))
def test_a_building_is_mapped_without_odometry(laser):
    """By lasers that see little; all three maps were off by more than a metre before."""
    place = building(2, 2)
    recording = drive(place, place.crossings(WAY), "building", None, *LASERS[laser])
    log = dataclasses.replace(recording.log(), odometry=None)
    assert rms(mapped(log).graph.poses, recording.truth) < 0.2
