"""A scan from which on odometry, or the ranges, count lengths by another factor."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.mount_fit import MountFit
from nscan_cli.calibration.odometry_options import ScaleChangeOptions
from nscan_cli.calibration.robust_fit import TO_SIGMA, median
from nscan_cli.poses import Array, Indices, compose, inverse

SIGMA_OF_MEDIAN = 1.2533
"""Standard deviation of the median of normal values, as a multiple of that of their mean."""


class ScaleChange(NamedTuple):
    """Metres by scans for one metre by odometry, in the steps before and behind a place."""

    step: int
    """The first step behind it."""
    before: float
    behind: float
    sigma: float
    """Standard deviation of the logarithm of their ratio."""

    def exceeds(self, factor: float, sigmas: float) -> bool:
        """Whether the two differ by more than a factor, and by more than so many standard deviations."""
        off = abs(math.log(self.behind / self.before))
        return off > max(math.log(factor), sigmas * self.sigma)


def scale_change(
    laser: Array, odometry: Array, sigmas: Array, fit: MountFit, options: ScaleChangeOptions
) -> ScaleChange | None:
    """The clearest change along steps (n, 3) of laser and robot, in order; None for too few steps.

    `sigmas` (n,) are the standard deviations of the lengths by scans, m.

    It is where two medians explain the logarithms of scales with the least absolute residuals.
    `fit` is the mounting that explains the steps.
    """
    robot = compose(compose(fit.mount, laser), inverse(fit.mount))
    by_scans, by_odometry = (np.hypot(steps[:, 0], steps[:, 1]) for steps in (robot, odometry))
    # Along bare walls scans tell hardly any length, and too short ones.
    is_told = (by_scans >= options.min_length) & (sigmas <= options.max_sigma * by_scans)
    told: Indices = np.flatnonzero(is_told & (by_odometry > 0.0))
    values = np.log(by_scans[told] / by_odometry[told])
    places = range(options.min_steps, len(told) - options.min_steps + 1)
    if not places:
        return None
    k = min(places, key=lambda place: _residual(values[:place]) + _residual(values[place:]))
    before, behind = (median(some) for some in (values[:k], values[k:]))
    sigma = sigma_of_change(values[:k] - before, values[k:] - behind)
    return ScaleChange(int(told[k]), float(np.exp(before)), float(np.exp(behind)), sigma)


def sigma_of_change(before: Array, behind: Array) -> float:
    """Standard deviation of the difference of two medians, from the residuals (n,) and (m,) about them.

    That of each is at least what the residuals of both say: a few values may be alike by chance.
    """
    own = [median(np.abs(some)) for some in (before, behind)]
    both = median(np.abs(np.concatenate([before, behind])))
    sigmas = [
        SIGMA_OF_MEDIAN * TO_SIGMA * max(deviation, both) / np.sqrt(len(some))
        for deviation, some in zip(own, (before, behind), strict=True)
    ]
    return max(float(np.hypot(*sigmas)), 1e-6)


def _residual(values: Array) -> float:
    """The sum of the distances of values (n,) from their median."""
    ordered, half = np.sort(values), len(values) // 2
    return float(ordered[len(values) - half :].sum() - ordered[:half].sum())
