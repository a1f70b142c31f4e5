"""How thick walls are in maps of lasers that turn: `python -m tests.benchmarks.wall_spread`.

The spread of points about the fitted walls of the final map: all points of all scans at their final poses
are put into cells of 0.5 m; where those of a cell lie along a line, their standard deviation across it
counts, as often as the cell has points. The median is printed, with the turn of the laser corrected and
without.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import transform
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.data import find_data
from tests.experiments.output import table

LOGS = {
    "rplidar-floor": ReadingOptions(),
    "rplidar-hallway.bag": ReadingOptions(),
    "neato.bag": ReadingOptions(topic="/stable_scan"),
    "urg-corridor-1.bag": ReadingOptions(),
    "urg-corridor-2.bag": ReadingOptions(),
    "urg-carried.bag": ReadingOptions(),
}
CELL = 0.5
"""m"""
LEAST = 30
"""Points of a cell that counts."""
LONGER = 2.0
"""Along the line the points of such a cell spread so many times as far as across it."""


def wall_spread(log: LaserLog, graph: Graph) -> float:
    """m; the median spread of the points of all scans, at the poses of the graph, across the walls."""
    poses = graph.poses
    moving = replace(log, mapped_path=graph.path).moving_along(poses)
    points = np.concatenate([
        transform(pose, seen) for pose, seen in zip(poses, moving.points_by_scan(), strict=True)
    ])  # fmt: skip
    _, cells, counts = np.unique(np.floor(points / CELL), axis=0, return_inverse=True, return_counts=True)
    cells = cells.ravel()
    middle = np.stack([np.bincount(cells, points[:, k]) for k in (0, 1)], axis=1) / counts[:, None]
    x, y = (points - middle[cells]).T
    xx, yy, xy = (np.bincount(cells, product) / counts for product in (x * x, y * y, x * y))
    root = np.hypot(xx - yy, 2 * xy)
    across, along = np.sqrt(np.maximum(xx + yy - root, 0.0) / 2), np.sqrt((xx + yy + root) / 2)
    used = (counts >= LEAST) & (along > LONGER * across)
    return float(np.median(np.repeat(across[used], counts[used])))


def _measured(name: str, options: ReadingOptions) -> float | None:
    path = find_data(f"field/{name}")
    if path is None:
        return None
    log = checked_file(read_log(str(path), options), options, FileCheckOptions()).log
    graph = run_slam(SlamState.of_log(log, SlamOptions()), lambda scans, keyframes: None)
    return wall_spread(log, graph)


def main() -> None:
    """Print the table of docs/accuracy.md."""
    rows = []
    for name, options in LOGS.items():
        spreads = [_measured(name, each) for each in (replace(options, sweep=0.0), options)]
        rows.append((name, *("–" if each is None else f"{1e3 * each:.1f}" for each in spreads)))
    print(table(("recording", "at once, mm", "corrected, mm"), rows))


if __name__ == "__main__":
    main()
