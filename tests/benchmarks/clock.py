"""Times of calls, and what they are compared with."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Timing:
    """One line of the table."""

    name: str
    milliseconds: float
    """Of the processor: the median over all cases of the best of some runs of each."""
    megabytes: float | None = None
    """Peak of the memory, of a process."""


def best_of(call: Callable[[], object], runs: int = 5) -> float:
    """The least time of some runs after a first one, ms."""
    call()
    times = []
    for _ in range(runs):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return 1000 * min(times)


def median_of(calls: Sequence[Callable[[], object]], runs: int = 5) -> float:
    """The median over several calls, ms."""
    return float(np.median([best_of(call, runs) for call in calls]))


def workload() -> None:
    """What never changes: arithmetic on arrays that fit into the cache."""
    x = np.linspace(0.0, 1.0, 20_000)
    for _ in range(60):
        x = np.exp(-x * x) + 0.1 * np.sqrt(x)
