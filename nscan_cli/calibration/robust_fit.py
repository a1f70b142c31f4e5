"""Linear least squares that outliers hardly move: wheels slip, and matches fail."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array

SWEEPS, FIRST_SWEEPS = 30, 10
"""Sweeps of reweighting, and how many of them minimise the sum of absolute values: it has one minimum."""
TO_SIGMA = 1.4826
"""The standard deviation of a Gaussian in medians of its absolute value."""
CAUCHY = 2.385
"""Residuals of so many standard deviations have half the weight: 95 % efficiency where all are Gaussian."""
LEAST_SIGMA = 1e-9
"""Residuals are at least so large, to divide by."""


class RobustFit(NamedTuple):
    """The fit of an overdetermined system."""

    values: Array
    """(m,) the unknowns."""
    covariance: Array
    """(m, m) of the unknowns; inf where the system leaves one open."""
    residuals: Array
    """(n,) length of each equation's residual."""


def robust_fit(coefficients: Array, measured: Array) -> RobustFit:
    """Minimise the residuals of coefficients (n, d, m) · values − measured (n, d), by Cauchy's loss.

    Iteratively reweighted least squares (P. Huber, "Robust Statistics", 1981), from the solution of least
    absolute values. An equation is a block of d rows, and gets one weight.
    """
    n, d, m = coefficients.shape
    weights = np.ones(n)
    values: Array = np.zeros(m)
    residuals: Array = np.zeros(n)
    for sweep in range(SWEEPS):
        roots = np.sqrt(weights)
        rows = (coefficients * roots[:, None, None]).reshape(n * d, m)
        solution = np.linalg.lstsq(rows, (measured * roots[:, None]).ravel(), rcond=None)
        values = np.asarray(solution[0], dtype=np.float64)
        residuals = np.sqrt(((coefficients @ values - measured) ** 2).sum(axis=1))
        sigma = max(TO_SIGMA * float(np.median(residuals)) / np.sqrt(d), LEAST_SIGMA)
        if sweep < FIRST_SWEEPS:
            weights = 1.0 / np.maximum(residuals, sigma / CAUCHY)
        else:
            weights = 1.0 / (1.0 + (residuals / (CAUCHY * sigma)) ** 2)
    # The weighted residuals estimate the variance, over the degrees of freedom that the weights leave.
    used = d * float(weights.sum()) - m
    variance = float((weights * residuals**2).sum()) / used if used > 0.0 else np.inf
    information = np.einsum("n,nda,ndb->ab", weights, coefficients, coefficients)
    covariance = np.full((m, m), np.inf)
    if np.linalg.cond(information) < 1e12 and np.isfinite(variance):
        covariance = variance * np.linalg.inv(information)
    return RobustFit(values, covariance, residuals)
