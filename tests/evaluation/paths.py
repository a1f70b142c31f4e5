"""Paths to compare, and what can be wrong with a reference."""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array

PERIOD = 0.1


def trajectory(poses: Array, start: float = 100.0, spatial: Array | None = None) -> Trajectory:
    """Poses (N, 3), one each PERIOD (s)."""
    times: Array = start + PERIOD * np.arange(len(poses), dtype=np.float64)
    return Trajectory(times, poses, tuple(map(repr, times.tolist())), spatial=spatial)


def drive(count: int = 600, seed: int = 1) -> Array:
    """(count, 3) poses of a robot that winds its way, now faster and now slower, and never twice alike."""
    rng = np.random.default_rng(seed)
    at = PERIOD * np.arange(count)

    def waves(size: float) -> Array:
        periods, phases = rng.uniform(8, 40, (6, 1)), rng.uniform(0, 2 * np.pi, (6, 1))
        found: Array = size * np.sin(2 * np.pi * at / periods + phases).sum(axis=0)
        return found

    heading = 0.1 * at + waves(0.5)
    speed = np.clip(0.5 + waves(0.12), 0.05, None)
    steps = PERIOD * speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.column_stack([np.cumsum(steps, axis=0), heading])


def noisy(poses: Array, seed: int = 2) -> Array:
    """Poses (N, 3) as a good result has them: 1 cm and 0.3° off."""
    return poses + np.random.default_rng(seed).normal(0, [0.01, 0.01, 0.005], poses.shape)
