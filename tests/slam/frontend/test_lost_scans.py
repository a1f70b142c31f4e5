"""Without odometry: scans that the local map says nothing of, at the start and later."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import relative, transform
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.tracker import Tracker
from tests.logs.excerpts import truth_of
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.scenes import Scene
from tests.simulation.world import Builder
from tests.slam.frontend.test_tracker import end_off
from tests.slam.mapped_logs import office_log, sensed, sensed_in


def across_a_yard(size: float, seed: int) -> LaserLog:
    """20 m across a yard with walls 22 · `size` m to both sides, without odometry."""
    plan = Builder()
    plan.box(-40.0 * size, -22.0 * size, 60.0 * size, 26.0 * size)
    for x, y in ((-10.0, 15.0), (14.0, -14.0), (26.0, 17.0)):
        plan.box(x * size, y * size, x * size + 6.0, y * size + 3.0)
    way, laser = np.array([(0.0, 0.0), (20.0, 0.0)]), Laser(max_range=80.0)
    log = Scene("yard", plan.world(), way, Drive(speed=1.0, period=0.2), laser).record(seed).log()
    return dataclasses.replace(log, odometry=None)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_between_walls_so_far_off_that_one_scan_makes_no_gaussians_the_robot_does_not_seem_to_stand(seed):
    """No scan joined the map until the robot had moved against it. All was lost, and 60 m of fr-clinic."""
    log = across_a_yard(1.0, seed)
    alone = Tracker(TrackingOptions(bridged_gap=0.0), odometry=False).track(sensed_in(log))
    assert np.hypot(*end_off(alone.poses, truth_of(log))[:2]) > 19.0
    found = Tracker(TrackingOptions(), odometry=False).track(sensed_in(log))
    assert np.hypot(*end_off(found.poses, truth_of(log))[:2]) < 0.05


def test_a_lost_scan_that_the_next_one_does_not_fit_stays_out_of_the_map():
    """A robot that pitches sees a wall where the ground is. Where it seems to be then is a guess, no more."""
    log = across_a_yard(0.5, 1)
    scans, strange = [log.points(row) for row in range(len(log))], 40
    angles = np.linspace(-1.5, 1.5, 180)
    scans[strange] = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    found = Tracker(TrackingOptions(), odometry=False).track(sensed(scans))
    assert np.flatnonzero(np.isinf(found.weakest_sigmas)).tolist() == [strange]
    assert not found.in_map[strange]
    assert not found.guess_variances.any()
    assert np.hypot(*end_off(found.poses, truth_of(log))[:2]) < 0.05


@pytest.mark.parametrize(("clear_score", "is_found"), [(0.25, True), (1.0, False)])
def test_a_scan_after_a_lost_one_is_where_a_search_finds_it_in_one_place_only(clear_score, is_found):
    """The robot turns by 30° while a scan sees nothing; bushes hide two thirds of the next one."""
    log = across_a_yard(0.5, 1)
    scans, strange, turn = [log.points(row) for row in range(len(log))], 40, np.radians(30)
    angles, noise = np.linspace(-1.5, 1.5, 180), np.random.default_rng(1)
    scans[strange] = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    for row in range(strange + 1, len(scans)):
        scans[row] = transform(np.array([0.0, 0.0, -turn]), scans[row])
    hidden = noise.random(len(scans[strange + 1])) < 0.65
    scans[strange + 1][hidden] *= noise.uniform(0.1, 0.8, (hidden.sum(), 1))
    options = TrackingOptions(clear_score=clear_score)
    found = Tracker(options, odometry=False).track(sensed(scans))
    lost = np.flatnonzero(np.isinf(found.weakest_sigmas)).tolist()
    assert lost[:1] == [strange]
    assert (strange + 1 not in lost) == is_found
    if is_found:
        after = relative(found.poses[strange + 1], truth_of(log)[strange + 1])
        before = relative(found.poses[strange - 1], truth_of(log)[strange - 1])
        np.testing.assert_allclose(after[2] - before[2], turn, atol=0.02)


def test_if_nothing_fits_any_more_tracking_goes_on_in_what_is_seen_now():
    """The way into it is a guess, as uncertain as a step without any scan; after it all is known again."""
    yard, office = across_a_yard(0.5, 1), office_log()
    scans = [yard.points(row) for row in range(40)] + [office.points(row) for row in range(20)]
    found = Tracker(TrackingOptions(), odometry=False).track(sensed(scans))
    lost = np.flatnonzero(np.isinf(found.weakest_sigmas))
    guessed = np.flatnonzero(found.guess_variances.any(axis=1))
    assert lost[0] == 40
    assert guessed.tolist() == [lost[-1] + 1]
    place, turn = np.sqrt(found.guess_variances[guessed[0]])
    assert place > 0.03
    assert turn > 0.01
    assert found.inliers[guessed[0] + 1 :].min() > 0.8
