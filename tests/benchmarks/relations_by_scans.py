"""What the scans say of reference relations: `python -m tests.benchmarks.relations_by_scans [LOG ...]`.

A relation says where a scan was in the frame of another one. The points of the second scan are put there,
once as the reference says and once as the map says. The share of them within 0.1 m of what the scans around
the first one saw tells which is right, where the two visits see the same. A relation is contradicted by the
scans where the map's share is greater by 0.2; the map is contradicted where the reference's is.
"""

from __future__ import annotations

import sys

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.evaluation.reference_relations import read_relations, relation_errors
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, Indices, relative, transform
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.data import find_data
from tests.experiments.output import table

LOGS = ("intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic")
AROUND = 4
"""Scans before and after the first scan of a relation whose points count as seen around it."""
WITHIN, NEAR = 0.1, 0.5
"""m; a point agrees within the first. Points within the second, by map or reference, are seen from both."""
CLEARLY = 0.2
"""Shares of agreeing points that differ by more decide."""
HEADER = (
    "log", "relations", "mean error, m", "agree: reference", "agree: map",
    "contradicted: reference", "contradicted: map", "mean without both, m",
)  # fmt: skip


def shares(points: list[Array], poses: Array, rows: Indices, reference: Array) -> Array:
    """(R, 2): which part of the points of the second scan agree, by the reference and by the map.

    `points` are those of every scan, `poses` (S, 3) the map's, `rows` (R, 2) the scans of each relation,
    `reference` (R, 3) its pose. nan where the two scans see nothing in common.
    """
    from scipy.spatial import cKDTree

    found = np.full((len(rows), 2), np.nan)
    for k, (first, second) in enumerate(rows.tolist()):
        around = range(max(0, first - AROUND), min(len(points), first + AROUND + 1))
        seen = np.concatenate([
            transform(relative(poses[row], poses[first]), points[row]) for row in around
        ])  # fmt: skip
        if len(seen) == 0 or len(points[second]) == 0:
            continue
        claims = (reference[k], relative(poses[second], poses[first]))
        tree = cKDTree(seen)
        distances = np.stack([tree.query(transform(pose, points[second]))[0] for pose in claims])
        common = (distances < NEAR).any(axis=0)
        if common.any():
            found[k] = (distances[:, common] < WITHIN).mean(axis=1)
    return found


def row(name: str) -> tuple[str, ...] | None:
    """The line of one log in the table; None where the log is absent."""
    path, relations_path = find_data(f"{name}.log.gz"), find_data(f"{name}.relations")
    if path is None or relations_path is None:
        return None
    reading = ReadingOptions()
    log = checked_file(read_log(str(path), reading), reading, FileCheckOptions()).log
    poses = run_slam(SlamState.of_log(log, SlamOptions()), lambda scans, keyframes: None).poses
    times = np.asarray(log.times)
    relations = read_relations(str(relations_path))
    errors = relation_errors(Trajectory(times, poses, tuple(map(str, times.tolist()))), relations)
    found = shares(list(log.points_by_scan()), poses, errors.rows, relations.poses[errors.used])
    better = found[:, 1] - found[:, 0]
    wrong = better > CLEARLY, better < -CLEARLY
    mean = errors.translation.mean(), errors.translation[~wrong[0] & ~wrong[1]].mean()
    agree = np.nanmean(found, axis=0)
    return (
        name, f"{len(better):,}", f"{mean[0]:.4f}", f"{agree[0]:.0%}", f"{agree[1]:.0%}",
        f"{wrong[0].sum():,}", f"{wrong[1].sum():,}", f"{mean[1]:.4f}",
    )  # fmt: skip


def main(names: list[str]) -> None:
    """Print the table of docs/accuracy.md."""
    rows = [cells for cells in map(row, names or LOGS) if cells is not None]
    print(table(HEADER, rows))


if __name__ == "__main__":
    main(sys.argv[1:])
