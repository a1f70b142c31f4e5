"""What decides the angle by which a result is turned into the frame of its reference."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.evaluation.alignment import alignment
from nscan_cli.poses import Array, compose
from tests.evaluation.paths import drive, noisy

PLACE = [3.0, -2.0, 1.0]
COUNT = 400


def standing() -> Array:
    return np.zeros((COUNT, 3))


def turning() -> Array:
    return np.column_stack([np.zeros((COUNT, 2)), np.linspace(0, 12, COUNT)])


def wandering(seed: int, step: float) -> Array:
    """Errors (COUNT, 3) that go together from pose to pose."""
    return np.cumsum(np.random.default_rng(seed).normal(0, step, (COUNT, 3)), axis=0)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("path", [standing, turning])
@pytest.mark.parametrize("point", [(0.0, 0.0), (0.02, 0.01), (0.3, -0.2)])
def test_where_a_robot_stays_the_headings_decide(seed, path, point):
    """Whatever the noise, and wherever the marker sits that the reference is of."""
    truth = compose(PLACE, compose(path(), [*point, 0.0])) + wandering(seed + 10, 1e-4)
    found = alignment(path() + wandering(seed, 2e-4), truth)
    assert found.by == "headings"
    assert found.motion[2] == pytest.approx(PLACE[2], abs=np.radians(0.6))


def test_what_does_not_move_at_all_is_aligned_too():
    found = alignment(standing(), compose(PLACE, standing()))
    assert (found.by, found.common) == ("headings", 0.0)
    np.testing.assert_allclose(found.motion, PLACE)


@pytest.mark.parametrize("length", [0.5, 5.0, 500.0])
def test_where_it_drives_the_positions_do(length):
    """Frames that are turned against each other change nothing then."""
    path = standing()
    path[:, 0] = np.linspace(0, length, COUNT)
    result = path + np.random.default_rng(3).normal(0, 0.003, path.shape)
    found = alignment(result, compose(compose(PLACE, path), [0.0, 0.0, 1.5]))
    assert found.by == "positions"
    assert found.motion[2] == pytest.approx(PLACE[2], abs=0.01)


def test_a_bad_result_of_a_drive_is_aligned_by_positions():
    """As others do, however little is left in common."""
    for seed in range(5):
        path = drive(COUNT)
        result = path + wandering(seed, 0.5)
        assert alignment(result, compose(PLACE, path)).by == "positions"


def test_the_angle_of_positions_is_that_of_least_squares():
    truth = compose(PLACE, drive())
    found = alignment(noisy(drive()), truth)
    a, b = noisy(drive())[:, :2], truth[:, :2]
    u, _, v = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
    turn = (u @ np.diag([1.0, np.linalg.det(u @ v)]) @ v).T
    assert found.motion[2] == pytest.approx(np.arctan2(turn[1, 0], turn[0, 0]), abs=1e-12)
    np.testing.assert_allclose(found.motion[:2], b.mean(axis=0) - turn @ a.mean(axis=0), atol=1e-9)


def test_headings_that_say_nothing_decide_nothing():
    rng = np.random.default_rng(4)
    truth = standing() + rng.normal(0, 0.2, (COUNT, 3))
    result = truth + rng.normal(0, 0.02, (COUNT, 3))
    result[:, 2] = rng.uniform(-np.pi, np.pi, COUNT)
    found = alignment(result, compose(PLACE, truth))
    assert found.by == "positions"
    assert found.motion[2] == pytest.approx(PLACE[2], abs=0.05)
