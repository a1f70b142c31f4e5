"""The lag between the clocks of result and reference: the one with the least cost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nscan_cli.evaluation.similarity import fit
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, Mask, wrap

LARGEST_LAG, SMALLEST_LAG = 120.0, 0.05
"""s; range of the lags that are searched and reported."""
GRID_STEPS = 400
"""Of the first search, which is refined around its best lag."""
MOST_POSES = 500
"""Poses of the result that are used, evenly spread."""
KEPT_POSES, KEPT_MOTION = 0.6, 0.5
"""Least share of the overlapping poses, and of the motion in them, that a lag must keep."""
OTHER_MINIMUM, COST_RATIO = 1.0, 1.5
"""Lags further from the best (s) must cost this many times more: robots can drive in circles."""

LEAST_POSES_FOR_LAG = 20
"""Of fewer poses, some lag makes any two paths fit."""
LEAST_MOTION, LARGEST_RESIDUAL = 0.2, 0.1
"""Least motion of a path (m, RMS about the mean), and largest residual as a share of it, for a fit."""

Cost = Callable[[Array, Array], float]
"""A cost of poses (N, 3) and of the true ones (N, 3)."""


@dataclass(frozen=True)
class Clocks:
    """Poses of a result, and a reference whose stamps may be of another clock."""

    times: Array
    """(N,) s"""
    poses: Array
    """(N, 3)"""
    reference: Trajectory

    @classmethod
    def of(cls, times: Array, poses: Array, reference: Trajectory) -> Clocks:
        """With at most MOST_POSES of the poses."""
        kept = np.linspace(0, len(times) - 1, min(len(times), MOST_POSES)).round().astype(np.int64)
        return cls(times[kept], poses[kept], reference)

    def at(self, lag: float) -> tuple[Array, Array]:
        """The poses that overlap the reference when a lag (s) is added to their stamps, and the true ones."""
        there = self._within(lag)
        times, known = self.times[there] + lag, self.reference
        columns = [np.interp(times, known.times, column) for column in known.poses[:, :2].T]
        turns = wrap(np.interp(times, known.times, np.unwrap(known.poses[:, 2])))
        return self.poses[there], np.column_stack([*columns, turns])

    def best(self, cost: Cost) -> tuple[float, float] | None:
        """The lag (s) of the least cost, and the cost; None where another lag is nearly as good."""
        least = max(10, KEPT_POSES * int(self._within(0.0).sum()))
        known = self.reference.times
        reach = min(LARGEST_LAG, float(min(self.times[-1] - self.times[0], known[-1] - known[0])) / 2)
        if reach <= SMALLEST_LAG:
            return None

        least_spread = KEPT_MOTION * _rms_spread(self.at(0.0)[1])

        def at(lag: float) -> float:
            poses, truth = self.at(lag)
            enough = len(poses) >= least and _rms_spread(truth) >= least_spread
            return cost(poses, truth) if enough else math.inf

        lags = np.linspace(-reach, reach, GRID_STEPS + 1)
        costs = np.array([at(lag) for lag in lags.tolist()])
        lag, step = float(lags[int(np.argmin(costs))]), float(lags[1] - lags[0])
        others = costs[np.abs(lags - lag) > max(10 * step, OTHER_MINIMUM)]
        for _ in range(4):
            lag = float(min(np.linspace(lag - step, lag + step, 21).tolist(), key=at))
            step /= 10
        is_unique = not len(others) or at(lag) * COST_RATIO < float(others.min())
        return (lag, at(lag)) if is_unique else None

    def _within(self, lag: float) -> Mask:
        """Which poses overlap the reference in time, with a lag (s)."""
        times = self.times + lag
        inside: Mask = (times >= self.reference.times[0]) & (times <= self.reference.times[-1])
        return inside


def lag_without_overlap(result: Trajectory, reference: Trajectory) -> float | None:
    """The lag (s) of clocks without a common time; None unless the paths clearly fit with it."""
    middle = float(reference.times[[0, -1]].mean() - result.times[[0, -1]].mean())
    clocks = Clocks.of(result.times + middle, result.poses, reference)
    if len(result) < LEAST_POSES_FOR_LAG or len(reference) < LEAST_POSES_FOR_LAG:
        return None
    found = clocks.best(lambda poses, truth: fit(poses, truth).apart_scaled)
    if found is None:
        return None
    there = fit(*clocks.at(found[0]))
    fits = there.spread > LEAST_MOTION and there.apart_scaled < LARGEST_RESIDUAL * there.spread
    return middle + found[0] if fits else None


def _rms_spread(poses: Array) -> float:
    """RMS distance of poses (N, 3) from their mean, m."""
    return float(np.sqrt(poses[:, :2].var(axis=0).sum())) if len(poses) else 0.0
