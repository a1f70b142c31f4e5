"""The energy of a path along which a laser sweeps: its gradient is the derivative."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import Array
from nscan_cli.slam.backend.uneven_path_energy import (
    UnevenPathProblem,
    UnevenPathSystem,
    evaluate_uneven_path,
)
from tests.ndt.transforms import ndt_of
from tests.ndt.wall_points import room

KNOTS, PARTS, GROUPS = 9, 4, 2
STARTS = np.concatenate([[0], np.cumsum(np.minimum(3, KNOTS - np.arange(KNOTS)))])
"""Of the columns of a pattern in which each knot has blocks with the next two."""
LOOSE = 1e6


def problem(sigma: float = LOOSE, speed: float = LOOSE, points: bool = True) -> UnevenPathProblem:
    """Each group of points is seen from its middle; terms with a loose sigma count for nothing."""
    ndt, groups = ndt_of(room(1)), GROUPS * (KNOTS - 1)
    seen = room(2) if points else np.zeros((0, 2))
    ends = np.linspace(0, len(seen), groups + 1).astype(np.int64)
    shares = np.repeat((np.arange(groups) % GROUPS + 0.5) / GROUPS, np.diff(ends))
    sigmas = np.array([sigma, sigma, speed, speed])
    return UnevenPathProblem(
        ndt.grid, ndt.half, seen, shares, ends, GROUPS, np.linspace(0.04, 0.06, KNOTS - 1),
        np.zeros((KNOTS, 3)), PARTS, 0.3, sigmas,
    )  # fmt: skip


def evaluated(at: UnevenPathProblem, knots: Array, stride: int = 1) -> UnevenPathSystem:
    found = UnevenPathSystem(np.empty(3), np.empty((KNOTS, 3)), np.empty((int(STARTS[-1]), 3, 3)))
    evaluate_uneven_path(at, STARTS, knots, 0.3, stride, found)
    return found


def differences(at: UnevenPathProblem, knots: Array) -> Array:
    """The gradient (K, 3) by central differences."""
    gradient, step = np.empty((KNOTS, 3)), 1e-6
    for index in np.ndindex(KNOTS, 3):
        off = np.zeros((KNOTS, 3))
        off[index] = step
        values = [float(evaluated(at, knots + sign * off).terms.sum()) for sign in (1.0, -1.0)]
        gradient[index] = (values[0] - values[1]) / (2 * step)
    return gradient


def some_knots(still: bool = False, straight: bool = False) -> Array:
    knots: Array = np.random.default_rng(3).normal(0.0, 0.01, (KNOTS, 3))
    knots[:, :2] *= not still
    knots[:, 2] *= not straight
    return knots


@pytest.mark.parametrize(
    ("terms", "way", "columns"),
    [
        ({}, {}, [0, 1, 2]),
        ({"sigma": 0.05, "points": False}, {}, [0, 1, 2]),
        # A turn of the velocity with the robot counts as known.
        ({"speed": 0.1, "points": False}, {"straight": True}, [0, 1]),
        ({"speed": 0.1, "points": False}, {"still": True}, [2]),
    ],
)
def test_the_gradient_is_the_derivative(terms, way, columns):
    at, knots = problem(**terms), some_knots(**way)
    expected = differences(at, knots)[:, columns]
    assert np.abs(expected).max() > 1e-3
    tolerance = 1e-5 * np.abs(expected).max()
    np.testing.assert_allclose(evaluated(at, knots).gradient[:, columns], expected, atol=tolerance)


def test_one_point_in_two_has_about_the_energy_of_all():
    whole, half = (evaluated(problem(), some_knots(), stride).terms[0] for stride in (1, 2))
    assert half == pytest.approx(whole, rel=0.15)
    assert half != whole
