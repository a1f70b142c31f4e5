"""Where the time of a run goes: `python -m tests.benchmarks.profile LOG ...`, on one thread.

Of the SLAM loop alone, without reading and writing: the time in each kernel, and what is left, that of the
interpreter and of NumPy. `--runs N` does it again and again, for a profiler that tells these two apart.
"""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from nscan_cli.cli.main import OBJECTS
from nscan_cli.compiled import Kernel
from nscan_cli.logs.load import read_log
from nscan_cli.logs.scan import LaserLog
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import Slam
from tests.experiments.output import table

NAMED = 8
"""Kernels that are named, those that take longest."""


@dataclass
class Spent:
    """Seconds of one run, those in each kernel that the interpreter calls, and how often it does."""

    whole: float = 0.0
    kernels: dict[str, float] = field(default_factory=dict)
    calls: int = 0

    @property
    def outside(self) -> float:
        """Those in no kernel."""
        return self.whole - sum(self.kernels.values())


def spent(log: LaserLog, runs: int) -> Spent:
    """Of the best of some runs; what was loaded before counts nowhere."""
    times = Spent()
    version = Kernel._version

    def timed(kernel: Kernel, kinds: object, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        compiled, name = version(kernel, kinds, arguments), kernel.py_func.__name__

        def call(*given: Any) -> Any:
            begun = time.perf_counter()
            result = compiled(*given)
            times.kernels[name] = times.kernels.get(name, 0.0) + time.perf_counter() - begun
            times.calls += 1
            return result

        return call

    best = None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Kernel, "_version", timed)
        for kernel in [each for each in gc.get_objects() if isinstance(each, Kernel)]:
            patch.setattr(kernel, "_versions", {})
            patch.setattr(kernel, "_by_looks", {})
        for _ in range(runs + 1):
            before, times = best, Spent()
            begun = time.perf_counter()
            Slam(log, SlamOptions()).run(lambda *done: None)
            times.whole = time.perf_counter() - begun
            best = times if before is None or times.whole < before.whole else before
    assert best is not None
    return best


def rows_of(name: str, times: Spent) -> list[list[str]]:
    """The kernels that take longest, and the others, and the rest."""
    kernels = sorted(times.kernels.items(), key=lambda each: -each[1])
    named = [*kernels[:NAMED], ("other kernels", sum(seconds for _, seconds in kernels[NAMED:]))]
    named += [(f"outside, {times.calls} calls", times.outside), ("all", times.whole)]
    return [
        [name, part, f"{1000 * seconds:.0f}", f"{100 * seconds / times.whole:.1f} %"]
        for part, seconds in named
    ]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="+")
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    gc.set_threshold(OBJECTS)
    rows: list[list[str]] = []
    for path in options.logs:
        log = read_log(path)
        rows += rows_of(log.source.name, spent(log, options.runs))
    print(table(["log", "where", "ms", "share"], rows))


if __name__ == "__main__":
    main()
