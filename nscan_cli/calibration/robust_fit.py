"""Linear least squares that outliers hardly move: wheels slip, and matches fail."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array, Indices

ITERATIONS, FIRST_ITERATIONS = 30, 10
"""Iterations of reweighting, and how many of them minimise the sum of absolute values: it has one minimum."""
SETTLED = 1e-6
"""Iterations end where they change the solution by a smaller share."""
TO_SIGMA = 1.4826
"""Standard deviation of a Gaussian as a multiple of the median of its absolute value."""
CAUCHY = 2.385
"""Residuals of this number of standard deviations have half the weight: 95 % efficiency for Gaussian ones."""
MOST_CONDITION = 1e12
"""A system with a larger condition number leaves a value open."""
MOST_LEVERAGE = 0.99
"""Factor of the leverage of each equation: with a leverage of 1 its residual would be divided by 0."""
LEAST_SIGMA = 1e-9
"""Least standard deviation of the residuals, to divide by."""


class RobustFit(NamedTuple):
    """The fit of an overdetermined system."""

    values: Array
    """(m,) the unknowns."""
    covariance: Array
    """(m, m) covariance of the unknowns; inf where the system leaves one open."""
    residuals: Array
    """(n,) length of each equation's residual."""


def robust_fit(coefficients: Array, measured: Array, groups: Indices | None = None) -> RobustFit:
    """Minimise the residuals of coefficients (n, d, m) · values − measured (n, d), by Cauchy's loss.

    `groups` (g,) are the first rows of groups of equations with dependent errors; without them all are
    independent.

    Iteratively reweighted least squares (P. Huber, "Robust Statistics", 1981), from the solution of least
    absolute values. An equation is a block of d rows, and gets one weight.
    """
    n, d, m = coefficients.shape
    weights = np.ones(n)
    values: Array = np.zeros(m)
    residuals: Array = np.zeros(n)
    rows, wanted = coefficients.reshape(n * d, m), measured.ravel()
    before: Array = np.full(m, np.inf)
    for iteration in range(ITERATIONS):
        weighted = (coefficients * weights[:, None, None]).reshape(n * d, m).T
        # What the equations leave open is 0.
        solution = np.linalg.lstsq(weighted @ rows, weighted @ wanted, rcond=None)
        values = np.asarray(solution[0], dtype=np.float64)
        residuals = np.sqrt(((rows @ values - wanted).reshape(n, d) ** 2).sum(axis=1))
        sigma = max(TO_SIGMA * median(residuals) / np.sqrt(d), LEAST_SIGMA)
        if iteration > FIRST_ITERATIONS and np.abs(values - before).max() <= SETTLED * np.abs(values).max():
            break
        before = values
        if iteration < FIRST_ITERATIONS:
            weights = 1.0 / np.maximum(residuals, sigma / CAUCHY)
        else:
            weights = 1.0 / (1.0 + (residuals / (CAUCHY * sigma)) ** 2)
    off = coefficients @ values - measured
    return RobustFit(values, _covariance(coefficients, off, CAUCHY * sigma, groups), residuals)


def median(values: Array) -> float:
    """The median of values (n,), faster than by np.median."""
    ordered = np.sort(values)
    return 0.5 * float(ordered[(len(values) - 1) // 2] + ordered[len(values) // 2])


def _covariance(coefficients: Array, off: Array, scale: float, groups: Indices | None) -> Array:
    """The covariance (m, m) of the unknowns from the residuals `off` (n, d); inf where a value is open.

    `scale`, in the unit of the residuals, is that of the loss. Residuals may be larger along one row of an
    equation than along another, so they are used themselves, in the sandwich of the M-estimator: P. Huber,
    "Robust Statistics", 1981, 6.3 and 7.6. An equation that moves the fit makes its own residual smaller. Its
    leverage corrects this: J. MacKinnon, H. White, "Some Heteroskedasticity-Consistent Covariance Matrix
    Estimators", 1985 (their HC3).
    """
    n, d, m = coefficients.shape
    weights = 1.0 / (1.0 + (off**2).sum(axis=1) / scale**2)
    along = np.einsum("nda,nd->na", coefficients, off)
    bend = np.einsum("n,nda,ndb->ab", weights, coefficients, coefficients)
    if n * d <= m or np.linalg.cond(bend) > MOST_CONDITION:
        return np.full((m, m), np.inf)
    hats = np.einsum("n,nda,ab,neb->nde", weights, coefficients, np.linalg.inv(bend), coefficients)
    others = np.linalg.solve(np.eye(d) - MOST_LEVERAGE * hats, off[:, :, None])[:, :, 0]
    pulls = np.einsum("n,nda,nd->na", weights, coefficients, others)
    if groups is not None:
        pulls = np.add.reduceat(pulls, groups)
    # Where a residual is beyond the scale, the loss bends the other way.
    bend -= np.einsum("n,na,nb->ab", 2.0 * (weights / scale) ** 2, along, along)
    if np.linalg.eigvalsh(bend)[0] <= 0.0:
        return np.full((m, m), np.inf)
    inverse = np.linalg.inv(bend)
    covariance: Array = inverse @ (pulls.T @ pulls) @ inverse
    return covariance
