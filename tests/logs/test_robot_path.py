"""The robot's path between the poses that are known."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.robot_path import RobotPath, bent_path, likelier_path, poses_at, robot_path
from nscan_cli.poses import Array, compose

RATE, RADIUS = 1.5, 0.4
"""rad/s, m"""


def on_circle(times: Array) -> Array:
    """(n, 3) poses of a robot that drives a circle to the left."""
    turns = RATE * np.asarray(times)
    return np.stack([RADIUS * np.sin(turns), RADIUS * (1 - np.cos(turns)), turns], axis=1)


def path_of(times: Array, poses: Array) -> RobotPath:
    path = robot_path(times, poses)
    assert path is not None
    return path


def assert_same(found: Array, expected: Array, atol: float = 1e-9) -> None:
    np.testing.assert_allclose(found[:, :2], expected[:, :2], atol=atol)
    np.testing.assert_allclose(np.exp(1j * found[:, 2]), np.exp(1j * expected[:, 2]), atol=atol)


def test_from_pose_to_pose_it_drives_an_arc():
    coarse, fine = np.arange(0, 5, 0.5), np.arange(-0.2, 4.9, 0.07)
    assert_same(poses_at(path_of(coarse, on_circle(coarse)), fine), on_circle(fine))


def test_without_a_turn_it_drives_straight():
    times = np.array([0.0, 1.0])
    path = path_of(times, np.array([[0.0, 0.0, 1.0], [2.0 * np.cos(1.0), 2.0 * np.sin(1.0), 1.0]]))
    middle = np.array([[np.cos(1.0), np.sin(1.0), 1.0]])
    assert_same(poses_at(path, np.array([0.5])), middle)


def test_unknown_poses_and_repeated_times_are_left_out():
    times = np.array([0.0, 0.1, 0.1, 0.2, 0.3])
    poses = on_circle(times)
    poses[2], poses[3] = 9.0, np.nan
    np.testing.assert_array_equal(path_of(times, poses).times, [0.0, 0.1, 0.3])
    assert robot_path(times[:1], poses[:1]) is None
    assert robot_path(times, np.full((5, 3), np.nan)) is None


@pytest.mark.parametrize(("pause", "step"), [(5.0, 1.0), (0.1, 4.0)])
def test_over_a_pause_or_a_leap_it_goes_on_as_before(pause, step):
    """A robot that is carried 1 m in 5 s, or 4 m in a tenth of one, does not drive so."""
    times = np.array([0.0, 0.1, 0.1 + pause])
    path = path_of(times, np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.05, step, 0.0]]))
    np.testing.assert_allclose(path.twists, [[0.5, 0.0, 0.0]] * 3, atol=1e-12)


def test_a_bent_path_leads_through_the_poses_and_moves_like_the_first_between_them():
    """Odometry in a frame of its own, and 2 % too long, knows that the robot stopped half-way."""
    fine = np.arange(0, 2.01, 0.05)
    driven = np.where(fine % 1.0 < 0.5, fine % 1.0, 0.5) + 0.5 * np.floor(fine)
    truth = on_circle(driven)
    odometry = compose(np.array([3.0, 1.0, 2.0]), truth * (1.02, 1.02, 1.02))
    scans = np.arange(0, 2.01, 0.5)
    poses = truth[::10]
    bent = bent_path(path_of(fine, odometry), scans, poses)
    assert bent is not None
    assert_same(poses_at(bent, scans), poses)
    # Steady motion would be 5 cm off here.
    assert np.abs(poses_at(path_of(scans[::2], poses[::2]), fine) - truth)[:, 0].max() > 0.05
    sparse = bent_path(path_of(fine, odometry), scans[::2], poses[::2])
    assert sparse is not None
    assert_same(poses_at(sparse, fine), truth, atol=0.01)


def test_motion_that_does_not_fit_the_poses_is_not_used():
    """Odometry that knows when the robot stopped is used; with another clock, steady motion is likelier."""
    fine = np.arange(0, 8.01, 0.05)
    driven = np.where(fine % 1.0 < 0.5, fine % 1.0, 0.5) + 0.5 * np.floor(fine)
    odometry, scans = path_of(fine, on_circle(driven)), np.arange(0, 8.01, 0.2)
    poses = on_circle(np.interp(scans, fine, driven))
    good = likelier_path(odometry, scans, poses)
    assert good is not None
    assert len(good.times) > len(scans)
    late = likelier_path(path_of(fine + 0.5, odometry.poses), scans, poses)
    assert late is not None
    np.testing.assert_array_equal(late.times, scans)
