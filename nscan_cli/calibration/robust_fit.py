"""Linear least squares that outliers hardly move: wheels slip, and matches fail."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.small_matrices import solve_definite
from nscan_cli.poses import Array, Indices

SWEEPS, FIRST_SWEEPS = 30, 10
"""Sweeps of reweighting, and how many of them minimise the sum of absolute values: it has one minimum."""
SETTLED = 1e-6
"""Sweeps end where they change the solution by a smaller share."""
TO_SIGMA = 1.4826
"""Standard deviation of a Gaussian as a multiple of the median of its absolute value."""
CAUCHY = 2.385
"""Residuals of this number of standard deviations have half the weight: 95 % efficiency for Gaussian ones."""
MOST_CONDITION = 1e12
"""A system with a larger condition number leaves a value open."""
MOST_LEVERAGE = 0.99
"""Factor of the leverage of each equation: with a leverage of 1 its residual would be divided by 0."""
LEAST_INFORMATION = 1e-14
"""Share of all information that keeps a value at 0 that the equations leave open."""
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
    values, residuals = np.zeros(coefficients.shape[2]), np.zeros(len(coefficients))
    rows = np.ascontiguousarray(coefficients, dtype=np.float64)
    sigma = _reweight(rows, np.ascontiguousarray(measured, dtype=np.float64), values, residuals)
    off = coefficients @ values - measured
    return RobustFit(values, _covariance(coefficients, off, CAUCHY * sigma, groups), residuals)


def median(values: Array) -> float:
    """The median of values (n,), faster than by np.median."""
    ordered = np.sort(values)
    return 0.5 * float(ordered[(len(values) - 1) // 2] + ordered[len(values) // 2])


@kernel
def _reweight(coefficients: Array, measured: Array, values: Array, residuals: Array) -> float:
    """Write values (m,) and residuals (n,); returns the standard deviation of these along one axis."""
    n, d, m = coefficients.shape
    weights, before = np.ones(n), np.full(m, np.inf)
    normal, right, sigma = np.empty((m, m)), np.empty(m), 0.0
    for sweep in range(SWEEPS):
        normal[:], right[:] = 0.0, 0.0
        for i in range(n):
            for k in range(d):
                for a in range(m):
                    weighted = weights[i] * coefficients[i, k, a]
                    right[a] += weighted * measured[i, k]
                    for b in range(a + 1):
                        normal[a, b] += weighted * coefficients[i, k, b]
        # What the equations leave open is 0.
        open_weight = LEAST_INFORMATION * np.trace(normal)
        for a in range(m):
            normal[a, a] += open_weight
        if not solve_definite(normal, right, values):
            values[:] = 0.0
        for i in range(n):
            square = 0.0
            for k in range(d):
                off = -measured[i, k]
                for a in range(m):
                    off += coefficients[i, k, a] * values[a]
                square += off * off
            residuals[i] = np.sqrt(square)
        ordered = np.sort(residuals)
        sigma = max(TO_SIGMA * 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2]) / np.sqrt(d), LEAST_SIGMA)
        if sweep > FIRST_SWEEPS and np.abs(values - before).max() <= SETTLED * np.abs(values).max():
            break
        before[:] = values
        for i in range(n):
            if sweep < FIRST_SWEEPS:
                weights[i] = 1.0 / max(residuals[i], sigma / CAUCHY)
            else:
                weights[i] = 1.0 / (1.0 + (residuals[i] / (CAUCHY * sigma)) ** 2)
    return sigma


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
