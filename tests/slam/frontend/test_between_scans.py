"""How densely the laser scans does not change how far the robot comes."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, relative
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions
from nscan_cli.slam.frontend.tracker import Tracker
from tests.data import data_file
from tests.slam.mapped_logs import mapped, sensed

STEP = 0.02
"""Distance from scan to scan in the corridor, m."""


def corridor(scans: int) -> tuple[list[Array], Array]:
    """Points of two bare walls 2 m apart, seen up to 5.6 m with 1 cm of noise, and odometry 1 % too long."""
    angles, random = np.radians(np.linspace(-120, 120, 682)), np.random.default_rng(4)
    ranges = 1.0 / np.maximum(np.abs(np.sin(angles)), 1e-9)
    seen = ranges < 5.6
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)[seen]
    points = [directions * (ranges[seen] + random.normal(0, 0.01, seen.sum()))[:, None] for _ in range(scans)]
    odometry = np.zeros((scans, 3))
    odometry[:, 0] = 1.01 * STEP * np.arange(scans)
    return points, odometry


@pytest.mark.parametrize("every", [1, 2, 3, 5])
def test_a_bare_corridor_is_as_long_as_odometry_has_it_however_dense_the_scans(every):
    points, odometry = corridor(151)
    scans = sensed(points[::every], odometry[::every])
    found = Tracker(TrackingOptions()).track(scans)
    way = found.poses[-1, 0] - found.poses[0, 0]
    assert way == pytest.approx(odometry[::every][-1, 0], rel=0.02)


def test_scans_that_are_all_matched_with_a_wide_prior_lose_the_way():
    """The ripple of the map holds the robot back: what the scans between are there for."""
    points, odometry = corridor(151)
    wide = ScanTrackingOptions().odometry
    options = TrackingOptions(scan=ScanTrackingOptions(match_motion=0.0, trusted_odometry=wide))
    found = Tracker(options).track(sensed(points, odometry))
    assert found.poses[-1, 0] - found.poses[0, 0] < 0.97 * odometry[-1, 0]


def test_scans_between_two_matched_ones_lie_on_the_way():
    points, odometry = corridor(40)
    found = Tracker(TrackingOptions()).track(sensed(points, odometry))
    assert np.count_nonzero(found.in_map) < 12
    # The map of the first two matched scans is sparse.
    steps = relative(found.poses[6:], found.poses[5:-1])
    np.testing.assert_allclose(steps[:, 0], STEP, atol=0.012)
    np.testing.assert_allclose(found.paths[5:], found.poses[5:, 0], atol=0.02)
    # The covariance of the way is shared out: no step is free.
    assert (np.linalg.eigvalsh(found.prior_covariances[1:]) > 0).all()


def test_a_robot_that_turns_while_odometry_stands_is_matched_at_once():
    """Where its clock lags, odometry has the robot standing. A scan that says otherwise does not wait."""
    room = square_room()
    turns = np.array([0.0, 0.0, 0.25, 0.5, 0.75])
    points = [turned(room, -turn) for turn in turns]
    found = Tracker(TrackingOptions()).track(sensed(points, np.zeros((len(turns), 3))))
    np.testing.assert_allclose(found.poses[:, 2], turns, atol=0.02)
    np.testing.assert_allclose(found.poses[:, :2], 0.0, atol=0.03)


def square_room() -> Array:
    """Points every 3 cm on the walls of a room of 6 m × 4 m with a pillar, seen from (0, 0)."""
    x, y = np.arange(-2.0, 4.0, 0.03), np.arange(-1.0, 3.0, 0.03)
    walls = [np.stack([x, np.full_like(x, side)], axis=1) for side in (-1.0, 3.0)]
    walls += [np.stack([np.full_like(y, side), y], axis=1) for side in (-2.0, 4.0)]
    pillar = np.stack([np.full(20, 1.5), np.linspace(1.0, 1.6, 20)], axis=1)
    return np.concatenate([*walls, pillar])


def turned(points: Array, angle: float) -> Array:
    """The points (m, 2) turned about the origin."""
    c, s = np.cos(angle), np.sin(angle)
    result: Array = points @ np.array([[c, s], [-s, c]])
    return result


def test_scans_that_wait_are_settled_with_the_next_ones():
    """A batch that ends between two matched scans: the result is that of one batch, to the bit."""
    points, odometry = corridor(60)
    scans = sensed(points, odometry)
    expected = Tracker(TrackingOptions()).track(scans)
    tracker, found, settled = Tracker(TrackingOptions()), [], 0
    for end in [*range(7, 60, 7), 60]:
        found.append(tracker.track(scans.part(settled, end), may_wait=end < 60))
        settled += len(found[-1].values)
        assert settled == 60 if end == 60 else settled < 60
    np.testing.assert_array_equal(np.concatenate([part.poses for part in found]), expected.poses)


@pytest.mark.parametrize("every", [1, 2, 3, 5])
def test_a_real_corridor_is_as_long_as_odometry_has_it(every):
    """1.15 m by odometry from scan 180 to 240, where the robot drives at 0.2 m/s throughout."""
    log = read_log(str(data_file("field/urg-corridor-1.bag")), ReadingOptions(end=30.0, every=every))
    assert log.odometry is not None
    poses = np.concatenate(mapped(log).state.tracked)
    whole = read_log(str(data_file("field/urg-corridor-1.bag")), ReadingOptions(end=30.0))
    ends = np.searchsorted(log.times, whole.times[[180, 240]])
    way = np.hypot(*(poses[ends[1]] - poses[ends[0]])[:2])
    assert way == pytest.approx(1.15, abs=0.12)
