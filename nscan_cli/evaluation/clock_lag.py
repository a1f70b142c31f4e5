"""The lag between the clocks of result and reference: the one with the least cost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nscan_cli.evaluation.options import ClockLagOptions, EvaluationOptions, RemarkOptions
from nscan_cli.evaluation.similarity import fit_similarity
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, Mask, wrap

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
    options: ClockLagOptions

    @classmethod
    def of(cls, times: Array, poses: Array, reference: Trajectory, options: ClockLagOptions) -> Clocks:
        """With at most `max_poses` of the poses."""
        kept = np.linspace(0, len(times) - 1, min(len(times), options.max_poses)).round().astype(np.int64)
        return cls(times[kept], poses[kept], reference, options)

    def at(self, lag: float) -> tuple[Array, Array]:
        """The poses that overlap the reference when a lag (s) is added to their stamps, and the true ones."""
        there = self._within(lag)
        times, known = self.times[there] + lag, self.reference
        columns = [np.interp(times, known.times, column) for column in known.poses[:, :2].T]
        turns = wrap(np.interp(times, known.times, np.unwrap(known.poses[:, 2])))
        return self.poses[there], np.column_stack([*columns, turns])

    def best(self, cost: Cost) -> tuple[float, float] | None:
        """The lag (s) of the least cost, and the cost; None where another lag is nearly as good."""
        options, known = self.options, self.reference.times
        least = max(options.min_kept_poses, options.kept_poses * int(self._within(0.0).sum()))
        reach = min(options.max_lag, float(min(self.times[-1] - self.times[0], known[-1] - known[0])) / 2)
        if reach <= options.min_lag:
            return None

        least_spread = options.kept_motion * _rms_spread(self.at(0.0)[1])

        def at(lag: float) -> float:
            poses, truth = self.at(lag)
            enough = len(poses) >= least and _rms_spread(truth) >= least_spread
            return cost(poses, truth) if enough else math.inf

        lags = np.linspace(-reach, reach, options.steps + 1)
        costs = np.array([at(lag) for lag in lags.tolist()])
        lag, step = float(lags[int(np.argmin(costs))]), float(lags[1] - lags[0])
        others = costs[np.abs(lags - lag) > max(options.other_steps * step, options.other_lag)]
        for _ in range(options.refinements):
            tried = np.linspace(lag - step, lag + step, 2 * options.refined_steps + 1)
            lag = float(min(tried.tolist(), key=at))
            step /= options.refined_steps
        is_unique = not len(others) or at(lag) * options.cost_ratio < float(others.min())
        return (lag, at(lag)) if is_unique else None

    def _within(self, lag: float) -> Mask:
        """Which poses overlap the reference in time, with a lag (s)."""
        times = self.times + lag
        inside: Mask = (times >= self.reference.times[0]) & (times <= self.reference.times[-1])
        return inside


def lag_without_overlap(
    result: Trajectory, reference: Trajectory, options: RemarkOptions = EvaluationOptions.remarks
) -> float | None:
    """The lag (s) of clocks without a common time; None unless the paths clearly fit with it."""
    if min(len(result), len(reference)) < options.clock_lag.min_poses:
        return None
    middle = float(reference.times[[0, -1]].mean() - result.times[[0, -1]].mean())
    clocks = Clocks.of(result.times + middle, result.poses, reference, options.clock_lag)
    found = clocks.best(lambda poses, truth: fit_similarity(poses, truth).apart_scaled)
    if found is None:
        return None
    there = fit_similarity(*clocks.at(found[0]))
    fits = there.spread > options.min_motion and there.apart_scaled < options.max_residual * there.spread
    return middle + found[0] if fits else None


def _rms_spread(poses: Array) -> float:
    """RMS distance of poses (N, 3) from their mean, m."""
    return float(np.sqrt(poses[:, :2].var(axis=0).sum())) if len(poses) else 0.0
