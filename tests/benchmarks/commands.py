"""Whole commands: the processor's time of each process, with the kernels compiled before."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.benchmarks.clock import Timing
from tests.benchmarks.processes import Used, run
from tests.data import CORRIDOR_LOG, OFFICE_LOG, find_data

REAL = ("intel", "fr079", "mit-csail", "mit-killian", "fr-campus")
RUNS = 5


def timings() -> Iterator[Timing]:
    """One by one."""
    small = CORRIDOR_LOG
    with TemporaryDirectory() as folder:
        graph, picture = str(Path(folder, "graph.json")), str(Path(folder, "map.png"))

        def slam(log: str) -> list[str]:
            return ["slam", log, "-o", graph, "--map", picture, "--threads", "1", "-q"]

        yield _timed("process: --version", ["--version"], RUNS)
        yield _timed("process: --help", ["--help"], RUNS)
        yield _timed("process: info of a small log", ["info", small], RUNS)
        yield _timed(
            "process: match of two scans of a small log",
            ["match", small, "--reference", "10", "--scan", "12"],
            RUNS,
        )
        yield _timed("process: slam, office", slam(OFFICE_LOG), 3)
        for name in REAL:
            path = find_data(f"{name}.log.gz")
            if path is not None:
                yield _timed(f"process: slam, {name}", slam(str(path)), 1)


def _timed(name: str, arguments: list[str], runs: int) -> Timing:
    """The median of some runs after a first one, which may have to compile."""
    times: list[Used] = [run(["-m", "nscan_cli", *arguments]) for _ in range(runs + 1)][1:]
    memory = max(used.megabytes for used in times)
    return Timing(name, 1000 * float(np.median([used.seconds for used in times])), memory)
