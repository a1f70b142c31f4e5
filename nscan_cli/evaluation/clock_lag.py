"""By how much the clock of a reference is off: the lag at which another cost is least."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.evaluation.similarity import fit
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, wrap

LONGEST, SMALLEST = 120.0, 0.05
"""s; no lag beyond is looked for, and none below is told from the width of a scan."""
LAGS = 400
"""That are tried at once, then again between the neighbours of the best."""
SAMPLE = 500
"""Poses of the result that are looked at."""
ENOUGH, MOVED = 0.6, 0.5
"""Of the poses within the reference as it is, and of how far it moves meanwhile: so much at any lag."""
ELSEWHERE, UNIQUE = 1.0, 1.5
"""s from the best lag, from where on the cost has to be so many times higher: robots can drive in circles."""

FEWEST = 20
"""Poses; of fewer, some lag makes any two paths fit."""
DRIVEN, WELL = 0.2, 0.1
"""m (RMS about the mean) that a path has to move by, and of it, what may be left between it and another."""

Cost = Callable[[Array, Array], float]
"""Of poses (N, 3) and those that they should be."""


@dataclass(frozen=True)
class Clocks:
    """Poses of a result, and a reference whose stamps may be those of another clock."""

    times: Array
    """(N,) s"""
    poses: Array
    """(N, 3)"""
    reference: Trajectory

    @classmethod
    def of(cls, times: Array, poses: Array, reference: Trajectory) -> Clocks:
        """With so many of the poses as are enough."""
        kept = np.linspace(0, len(times) - 1, min(len(times), SAMPLE)).round().astype(np.int64)
        return cls(times[kept], poses[kept], reference)

    def at(self, lag: float) -> tuple[Array, Array]:
        """The poses within the reference when a lag (s) is added to their stamps, and what it has there."""
        there = self._within(lag)
        times, known = self.times[there] + lag, self.reference
        columns = [np.interp(times, known.times, column) for column in known.poses[:, :2].T]
        turns = wrap(np.interp(times, known.times, np.unwrap(known.poses[:, 2])))
        return self.poses[there], np.column_stack([*columns, turns])

    def best(self, cost: Cost) -> tuple[float, float] | None:
        """The lag (s) of the least cost, and the cost; None where others are nearly as good."""
        least = max(10, ENOUGH * int(self._within(0.0).sum()))
        known = self.reference.times
        reach = min(LONGEST, float(min(self.times[-1] - self.times[0], known[-1] - known[0])) / 2)
        if reach <= SMALLEST:
            return None

        least_spread = MOVED * _spread(self.at(0.0)[1])

        def at(lag: float) -> float:
            poses, truth = self.at(lag)
            enough = len(poses) >= least and _spread(truth) >= least_spread
            return cost(poses, truth) if enough else math.inf

        lags = np.linspace(-reach, reach, LAGS + 1)
        costs = np.array([at(lag) for lag in lags.tolist()])
        lag, step = float(lags[int(np.argmin(costs))]), float(lags[1] - lags[0])
        others = costs[np.abs(lags - lag) > max(10 * step, ELSEWHERE)]
        for _ in range(4):
            lag = float(min(np.linspace(lag - step, lag + step, 21).tolist(), key=at))
            step /= 10
        is_unique = not len(others) or at(lag) * UNIQUE < float(others.min())
        return (lag, at(lag)) if is_unique else None

    def _within(self, lag: float) -> NDArray[np.bool_]:
        """Which poses lie between the first and the last of the reference."""
        times = self.times + lag
        inside: NDArray[np.bool_] = (times >= self.reference.times[0]) & (times <= self.reference.times[-1])
        return inside


def far_lag(result: Trajectory, reference: Trajectory) -> float | None:
    """The lag (s) of clocks that have no time in common, where one makes the paths fit without doubt."""
    middle = float(reference.times[[0, -1]].mean() - result.times[[0, -1]].mean())
    clocks = Clocks.of(result.times + middle, result.poses, reference)
    if len(result) < FEWEST or len(reference) < FEWEST:
        return None
    found = clocks.best(lambda poses, truth: fit(poses, truth).apart_scaled)
    if found is None:
        return None
    there = fit(*clocks.at(found[0]))
    fits = there.spread > DRIVEN and there.apart_scaled < WELL * there.spread
    return middle + found[0] if fits else None


def _spread(poses: Array) -> float:
    """How far poses (N, 3) lie apart: RMS about their mean, m."""
    return float(np.sqrt(poses[:, :2].var(axis=0).sum())) if len(poses) else 0.0
