"""Where the time of a run goes: `python -m tests.benchmarks.profile LOG ...`, on one thread.

Of the SLAM loop alone, without reading and writing: the time in each kernel, and what is left, that of the
interpreter and of NumPy. With `--perf` these two are told apart, as perf samples the runs once more.
"""

from __future__ import annotations

import argparse
import gc
import os
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from nscan_cli.cli.main import GC_THRESHOLD
from nscan_cli.kernels.decorators import Kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.experiments.output import table

NAMED = 8
"""Kernels that are named, those that take longest."""
NAMED_LIBRARIES = 4


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

    def timed(name: str, version: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any) -> Any:
            begun = time.perf_counter()
            result = version(*given)
            times.kernels[name] = times.kernels.get(name, 0.0) + time.perf_counter() - begun
            times.calls += 1
            return result

        return call

    # All that it takes is loaded then.
    run_slam(SlamState.of_log(log, SlamOptions()), lambda *done: None)
    best = None
    with pytest.MonkeyPatch.context() as patch:
        for kernel in [each for each in gc.get_objects() if type(each) is Kernel]:
            versions = {
                kinds: timed(kernel.py_func.__name__, each) for kinds, each in kernel.specialisations.items()
            }
            patch.setattr(kernel, "specialisations", versions)
            patch.setattr(kernel, "by_fingerprint", {})
        for _ in range(runs):
            before, times = best, Spent()
            begun = time.perf_counter()
            run_slam(SlamState.of_log(log, SlamOptions()), lambda *done: None)
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


def libraries(log: LaserLog, runs: int) -> list[tuple[str, str]]:
    """What shares of some runs the libraries have where most time goes, as perf samples them."""
    with TemporaryDirectory() as folder:
        samples = str(Path(folder, "perf.data"))
        attach = ["perf", "record", "-q", "-F", "2000", "-o", samples, "-p", str(os.getpid())]
        with subprocess.Popen(attach, stderr=subprocess.DEVNULL) as recorder:
            # It says nowhere that it has begun.
            time.sleep(1)
            for _ in range(runs):
                run_slam(SlamState.of_log(log, SlamOptions()), lambda *done: None)
            recorder.send_signal(signal.SIGINT)
        report = subprocess.run(
            ["perf", "report", "-i", samples, "--sort", "dso", "--stdio"],
            check=True,
            capture_output=True,
            text=True,
        )
    lines = [line.split() for line in report.stdout.splitlines() if "%" in line]
    return [(library, share) for share, library, *_ in lines[:NAMED_LIBRARIES]]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="+")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--perf", action="store_true", help="sample the libraries, too")
    options = parser.parse_args()
    gc.set_threshold(GC_THRESHOLD)
    rows: list[list[str]] = []
    for path in options.logs:
        log = read_log(path)
        rows += rows_of(log.source.name, spent(log, options.runs))
        if options.perf:
            rows += [
                [log.source.name, f"in {library}", "", share]
                for library, share in libraries(log, options.runs)
            ]
    print(table(["log", "where", "ms", "share"], rows))


if __name__ == "__main__":
    main()
