"""Least squares that outliers hardly move."""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.robust_fit import robust_fit


def line(seed: int, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Points of y = 2 x + 1 with a noise of 0.1, as equations."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-3, 3, count)
    rows = np.stack([x, np.ones(count)], axis=1)[:, None, :]
    return rows, (2 * x + 1 + rng.normal(scale=0.1, size=count))[:, None]


def test_outliers_hardly_move_it():
    rows, measured = line(1)
    measured[::4] += 5.0
    np.testing.assert_allclose(robust_fit(rows, measured).values, [2, 1], atol=0.05)


def test_its_covariance_is_that_of_its_errors():
    """Normalised squared errors of 200 fits: 2 degrees of freedom."""
    squares = []
    for seed in range(200):
        fit = robust_fit(*line(seed))
        off = fit.values - (2, 1)
        squares.append(off @ np.linalg.solve(fit.covariance, off))
    assert 1.6 < np.mean(squares) < 2.6


def test_what_the_equations_leave_open_is_unknown():
    rows = np.zeros((10, 1, 2))
    rows[:, 0, 0] = 1.0
    fit = robust_fit(rows, np.full((10, 1), 3.0))
    assert np.isclose(fit.values[0], 3.0)
    assert np.isinf(fit.covariance).all()
