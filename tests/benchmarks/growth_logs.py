"""Writes the logs of one drive in all sizes: `python -m tests.benchmarks.growth_logs NAME MOST FOLDER`."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.benchmarks.growth import LOOPS, SCANS
from tests.simulation.building import first, growing, rounds


def main(name: str, most: int, folder: str) -> None:
    """The files are named by the number of their scans, with leading zeros."""
    if name == "growing":
        sizes = [scans for scans in SCANS if scans <= most]
        longest = growing(sizes[-1])
    else:
        once = len(rounds(1).times)
        sizes = [once * loops for loops in LOOPS if once * loops <= most]
        longest = rounds(LOOPS[len(sizes) - 1])
    for scans in sizes:
        Path(folder, f"{scans:07}.log").write_bytes(first(longest, scans).carmen())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3])
