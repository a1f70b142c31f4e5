"""How time and memory of `slam` grow with the log: `python -m tests.benchmarks.growth OUT.json [PLOT.png]`.

Two simulated drives: round and round the same blocks of a building, and on through one without end. Each
size is the beginning of the longest, and is mapped in a process of its own on one thread. `--most N` leaves
out what has more scans, `--series NAME` the other drive.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.benchmarks.processes import run
from tests.experiments.charts import line_chart

LOOPS = (1, 2, 4, 8, 16, 32, 64)
SCANS = (3_125, 6_250, 12_500, 25_000, 50_000, 100_000, 200_000)
LATER = 3
"""The exponents of growth are those of the last sizes."""


@dataclass(frozen=True)
class Row:
    """One size."""

    scans: int
    keyframes: int
    nscan: int
    """nScan relations."""
    seconds: float
    """Of the processor."""
    megabytes: float
    """Peak of the whole process."""


def main() -> None:
    """Measure, print the table, write it and draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("plot", nargs="?")
    parser.add_argument("--most", type=int, default=SCANS[-1])
    parser.add_argument("--series", choices=("rounds", "growing"))
    options = parser.parse_args()
    series: dict[str, list[Row]] = {}
    for name in (options.series,) if options.series else ("rounds", "growing"):
        print(
            f"{name:<10}{'scans':>9}{'keyframes':>11}{'nScan':>8}{'CPU, s':>10}{'ms/scan':>9}{'RSS, MB':>9}"
        )
        series[name] = []
        for row in measured(name, options.most):
            series[name].append(row)
            each = 1000 * row.seconds / row.scans
            print(f"{row.scans:>19}{row.keyframes:>11}{row.nscan:>8}{row.seconds:>10.1f}{each:>9.2f}"
                  f"{row.megabytes:>9.0f}", flush=True)  # fmt: skip
        time, memory = exponents(series[name])
        print(f"{'':<10}time grows with the {time:.2f}th power of the scans, memory with the {memory:.2f}th")
        document = {key: [asdict(row) for row in rows] for key, rows in series.items()}
        Path(options.out).write_text(json.dumps(document, indent=1) + "\n")
    if options.plot:
        draw(series, options.plot)


def measured(name: str, most: int) -> Iterator[Row]:
    """All sizes of a drive, the smallest first."""
    with TemporaryDirectory() as folder:
        # In a process of its own: what this one held would count for those that it starts.
        subprocess.run(
            [sys.executable, "-m", "tests.benchmarks.growth_logs", name, str(most), folder], check=True
        )
        graph, map_file = Path(folder, "graph.json"), Path(folder, "map.png")
        for log in sorted(Path(folder).glob("*.log")):
            arguments = ["slam", str(log), "-o", str(graph), "--map", str(map_file), "--threads", "1", "-q"]
            used = run(["-m", "nscan_cli", *arguments])
            with graph.open() as lines:
                kinds = [('"keyframe":true' in line, '"type":"nscan"' in line) for line in lines]
            keyframes, nscan = np.sum(kinds, axis=0).tolist()
            yield Row(int(log.stem), keyframes, nscan, round(used.seconds, 2), round(used.megabytes, 1))


def exponents(rows: list[Row]) -> tuple[float, float]:
    """Of the power of the number of scans that time and memory grow with, over the last sizes.

    Of the memory, what the smallest takes is left out: it is the program and its libraries.
    """
    later = rows[-LATER:]
    scans = np.log([row.scans for row in later])
    seconds = np.log([row.seconds for row in later])
    grown = np.log([max(row.megabytes - rows[0].megabytes, 1.0) for row in later])
    return float(np.polyfit(scans, seconds, 1)[0]), float(np.polyfit(scans, grown, 1)[0])


def draw(series: dict[str, list[Row]], path: str) -> None:
    """Time over scans, and memory, one above the other."""
    from nscan_cli.mapping.figures.canvas import figure_png
    from nscan_cli.mapping.figures.panels import stack_images

    charts = []
    for key, label in (("seconds", "processor time, s"), ("megabytes", "peak memory, MB")):
        lines = {
            name: (
                np.array([row.scans / 1000 for row in rows]),
                np.array([float(getattr(row, key)) for row in rows]),
            )
            for name, rows in series.items()
        }
        charts.append(line_chart(lines, "thousand scans", label, "nscan-cli slam, one thread"))
    Path(path).write_bytes(figure_png(stack_images(charts)))


if __name__ == "__main__":
    main()
