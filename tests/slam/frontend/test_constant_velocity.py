"""Without odometry: of several predictions by constant velocity, the one that was best so far is taken."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.matching.motion_model import no_prior
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose
from nscan_cli.slam.frontend.constant_velocity import constant_velocity, expected_errors, learn_prediction
from nscan_cli.slam.frontend.match_restarts import match_near_prediction
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.track_state import KNOWN, TrackingProblem, TrackState
from nscan_cli.slam.frontend.tracked_scans import TrackedScans

OPTIONS = ScanTrackingOptions()


def learned(times: Array, poses: Array) -> TrackState:
    """The state of tracking after scans at times (S,) and poses (S, 3)."""
    track = TrackState.begin(6, OPTIONS)
    for time, pose in zip(times, poses, strict=True):
        learn_prediction(track, OPTIONS, time, pose)
        track.poses[:-1], track.times[:-1] = track.poses[1:].copy(), track.times[1:].copy()
        track.poses[-1], track.times[-1] = pose, time
        track.counts[KNOWN] = min(track.counts[KNOWN] + 1, 6)
    return track


def predicted(track: TrackState, time: float, is_steady: bool = False) -> Array:
    step = np.empty(3)
    constant_velocity(track, OPTIONS, time, is_steady, step)
    return step


def straight(places: Array) -> Array:
    return np.column_stack([places, np.zeros((len(places), 2))])


def test_a_robot_that_is_recorded_at_any_time_goes_as_far_as_the_time_is_long():
    """The laser log of fr-campus has a scan after each metre or 12°, 0.2 to 1.8 s apart."""
    times = np.cumsum(np.random.default_rng(1).uniform(0.4, 0.8, 200))
    step = predicted(learned(times, straight(0.7 * times)), times[-1] + 0.9)
    np.testing.assert_allclose(step, [0.63, 0.0, 0.0], atol=1e-9)


def test_stamps_in_bursts_say_nothing_of_the_way():
    """So are those of intel: scans of one period have the same time."""
    places, times = 0.1 * np.arange(200.0), np.repeat(np.arange(50.0), 4)
    step = predicted(learned(times, straight(places)), times[-1] + 1.0)
    np.testing.assert_allclose(step, [0.1, 0.0, 0.0], atol=1e-9)


def test_where_turns_change_steadily_the_last_step_tells_the_next():
    """The mean of five steps is two steps late."""
    turns = np.abs((np.arange(200) + 20) % 80 - 40) * 0.005
    poses = np.column_stack([np.zeros((200, 2)), np.cumsum(turns)])
    track = learned(np.arange(200.0), poses)
    assert predicted(track, 200.0)[2] == pytest.approx(turns[-1])
    assert abs(predicted(track, 200.0, is_steady=True)[2] - turns[-1]) > 0.009


def test_jitter_of_single_scans_is_evened_out():
    rng = np.random.default_rng(2)
    track = learned(np.arange(400.0), straight(0.1 * np.arange(400.0) + rng.normal(0.0, 0.02, 400)))
    assert abs(predicted(track, 400.0)[0] - 0.1) < 0.02
    place, turn = expected_errors(track)
    # Mean of the absolute difference between a scan's noise and that of the mean step before it.
    assert 0.01 < place < 0.04
    assert turn < 1e-3


def test_no_errors_are_known_before_all_predictions_were_tried():
    track = learned(np.arange(5.0), straight(np.arange(5.0)))
    assert expected_errors(track) == (np.inf, np.inf)
    np.testing.assert_allclose(predicted(track, 5.0), [1.0, 0.0, 0.0])


def wall(x: float, low: float, high: float) -> Array:
    ys = np.arange(low, high, 0.03)
    return np.column_stack([np.full(len(ys), x), ys])


@pytest.mark.parametrize("clearly_better", [False, True])
def test_a_poor_match_far_off_its_prediction_gives_way_to_one_near_it_that_is_as_good(clearly_better):
    """Two walls, 0.8 m one behind the other, of which the scan sees one; the rest of it fits nothing."""
    seen, strange = [wall(4.0, -1.0, 1.0), wall(4.0, 1.5, 3.0)], wall(1.0, 6.0, 9.0)
    mapped = [wall(4.0, -1.0, 1.0), wall(4.8, -1.0, 1.0)]
    if clearly_better:
        mapped.append(wall(4.8, 1.5, 3.0))
    # Walls to both sides hold it across and in angle.
    sides = np.column_stack([np.arange(-3.0, 3.0, 0.05), np.full(120, -3.0)])
    scan, points = np.concatenate([*seen, sides, strange]), np.concatenate([*mapped, sides])
    options = TrackingOptions(gaussians=GaussianOptions(floor=0.03))
    ndt = Ndt.of_scans(points, np.array([0, len(points)]), np.zeros((1, 3)), options.gaussians)
    track = learned(np.arange(50.0), straight(0.1 * np.arange(50.0) - 5.0))
    prior, found = no_prior(), TrackedScans.room(1)
    prior.information[:, :] = 6.0 * np.eye(3)
    settings = TrackingParameters.of(options, False)
    ends, nowhere = np.array([0, len(scan)]), np.full((1, 3), np.nan)
    problem = TrackingProblem(
        track, ndt.grid, settings, scan, ends, np.zeros(0), np.array([50.0]), nowhere, prior, found
    )
    far = np.array([0.8, 0.0, 0.0])
    # Near the prediction it is -74.
    found.poses[0], found.values[0], found.hessians[0] = far, -90.0 if clearly_better else -75.0, np.eye(3)
    fitting = np.concatenate([*seen[: 2 if clearly_better else 1], sides])
    found.inliers[0] = len(fitting) / len(scan)
    match_near_prediction(problem, scan, 0)
    np.testing.assert_allclose(found.poses[0], far if clearly_better else np.zeros(3), atol=0.02)
    np.testing.assert_array_equal(prior.information, 6.0 * np.eye(3))


def test_the_same_motion_in_another_frame_is_predicted_alike():
    rng = np.random.default_rng(3)
    poses = np.cumsum(rng.normal([0.1, 0.0, 0.05], 0.02, (60, 3)), axis=0)
    times, frame = np.cumsum(rng.uniform(0.1, 0.3, 60)), np.array([5.0, -2.0, 2.5])
    here, there = learned(times, poses), learned(times, compose(frame, poses))
    np.testing.assert_allclose(predicted(here, times[-1] + 0.2), predicted(there, times[-1] + 0.2), atol=1e-9)
