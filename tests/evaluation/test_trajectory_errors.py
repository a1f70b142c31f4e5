from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError
from nscan_cli.evaluation.alignment import alignment
from nscan_cli.evaluation.trajectory_errors import trajectory_errors
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import compose
from tests.evaluation import paths


def trajectory(poses: np.ndarray, start: float = 0.0) -> Trajectory:
    times = start + np.arange(float(len(poses)))
    return Trajectory(times, np.asarray(poses, dtype=float), tuple(str(time) for time in times.tolist()))


@given(st.integers(0, 2**32 - 1))
def test_a_moved_trajectory_has_no_error(seed: int):
    rng = np.random.default_rng(seed)
    truth = rng.uniform([-20, -20, -3], [20, 20, 3], size=(12, 3))
    motion = rng.uniform(-3, 3, size=3)
    errors = trajectory_errors(trajectory(truth), trajectory(compose(motion, truth)))
    np.testing.assert_allclose(errors.alignment.motion, motion, atol=1e-9)
    for spread in (errors.absolute_translation, errors.absolute_rotation, errors.relative_rotation):
        assert spread is not None
        assert spread.max < 1e-9


@given(st.integers(0, 2**32 - 1))
def test_no_small_motion_improves_the_alignment(seed: int):
    rng = np.random.default_rng(seed)
    poses, truth = rng.uniform(-5, 5, size=(2, 6, 3))
    best = alignment(poses, truth).motion

    def cost(motion: np.ndarray) -> float:
        return float(((compose(motion, poses) - truth)[:, :2] ** 2).sum())

    for step in 1e-3 * np.vstack([np.eye(3), -np.eye(3)]):
        assert cost(best + step) >= cost(best)


def test_the_absolute_error_of_one_pose_aside_is_this():
    # Truth: corners of a square of 2 m around the centre. The result has it, with two opposite corners
    # 0.1 m outwards along the diagonal. By symmetry the identity is best: errors 0.1, 0, 0.1, 0.
    truth = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0.0]])
    result = truth.copy()
    result[[0, 2], :2] += 0.1 * np.sqrt(0.5) * np.sign(truth[[0, 2], :2])
    result[1, 2] = np.radians(4)
    errors = trajectory_errors(trajectory(result), trajectory(truth))
    ate = errors.absolute_translation
    np.testing.assert_allclose(errors.alignment.motion, 0, atol=1e-12)
    assert ate.rmse == pytest.approx(np.sqrt(0.02 / 4))
    assert (ate.mean, ate.median, ate.max) == pytest.approx((0.05, 0.05, 0.1))
    assert errors.absolute_rotation.rmse == pytest.approx(2.0)


def test_the_relative_error_is_that_of_a_metre_of_path():
    # Steps of 0.25 m along x; the result makes them 1 % too long and turns by 0.001 rad at each.
    count = 9
    truth = np.column_stack([0.25 * np.arange(count), np.zeros(count), np.zeros(count)])
    result = truth * 1.01
    errors = trajectory_errors(trajectory(result), trajectory(truth))
    assert errors.relative_translation is not None
    assert errors.relative_translation.mean == pytest.approx(0.01)
    assert errors.relative_translation.max == pytest.approx(0.01)
    turning = truth.copy()
    turning[:, 2] = 0.001 * np.arange(count)
    errors = trajectory_errors(trajectory(turning), trajectory(truth))
    assert errors.relative_rotation is not None
    assert errors.relative_rotation.mean == pytest.approx(np.degrees(0.004))


def test_a_path_shorter_than_a_metre_has_no_relative_error():
    truth = np.array([[0, 0, 0], [0.5, 0, 0], [0.9, 0, 0]])
    errors = trajectory_errors(trajectory(truth), trajectory(truth))
    assert errors.relative_translation is None
    assert errors.relative_rotation is None


def test_poses_without_a_match_are_counted_and_left_out():
    truth = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    result = np.vstack([truth, [[50, 50, 0]]])
    errors = trajectory_errors(trajectory(result), trajectory(truth, start=0.05))
    assert (errors.matched, errors.unmatched) == (3, 1)
    assert errors.absolute_translation.max < 1e-12


def test_no_common_stamp_says_the_spans():
    truth = np.zeros((3, 3))
    with pytest.raises(
        InputDataError, match=r"a.json: no stamp of b.tum .* 0.000 to 2.000 s .*\+100.000 s off"
    ):
        trajectory_errors(trajectory(truth), trajectory(truth, start=100.0), "a.json", "b.tum")


@pytest.mark.parametrize("lag", [1000.0, -77.0, 1.7e9])
def test_clocks_that_have_no_time_in_common_are_told_by_the_paths(lag):
    whole = paths.trajectory(paths.drive())
    part = slice(100, 400)
    result = Trajectory(whole.times[part], paths.noisy(whole.poses[part]), whole.stamps[part])
    reference = replace(whole, times=whole.times + lag)
    with pytest.raises(
        InputDataError, match=rf"off at the start; stamps off by \{lag:+.1f}\d s fit best; give"
    ):
        trajectory_errors(result, reference)
    other = paths.trajectory(paths.drive(seed=5), start=100.0 + lag)
    with pytest.raises(InputDataError, match=r"off at the start; give the reference of this log"):
        trajectory_errors(result, other)


def test_one_common_stamp_is_not_enough():
    truth = np.zeros((3, 3))
    with pytest.raises(InputDataError, match=r"a.json: only one pose matches b.tum"):
        trajectory_errors(trajectory(truth), trajectory(truth, start=2.0), "a.json", "b.tum")
