"""Real logs with disturbed odometry, or cut: `python -m tests.benchmarks.robustness OUT.md [LOG…]`.

Each log ten times with noise on its odometry, and with five other first scans; with joint relations, and
with single ones only. A table a log goes to docs/robustness.md. Takes half an hour on two cores.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nscan_cli.evaluation.load_trajectory import load_reference
from nscan_cli.evaluation.reference_relations import read_relations, relation_errors
from nscan_cli.evaluation.trajectory_errors import trajectory_errors
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, compose, relative, wrap
from nscan_cli.slam.options import Relations, SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.data import find_data
from tests.experiments.output import table
from tests.logs.excerpts import excerpt

WANTED = {
    "intel": 0.014, "fr079": 0.0312, "mit-csail": 0.0262, "mit-killian": 0.0255, "fr-campus": 0.26,
    "fr-clinic": 0.108,
}  # fmt: skip
"""m; fr-campus: ATE RMSE, the others: mean error of the relations."""
SEEDS = 10
DROPPED = (0, 50, 130, 250, 400, 500)
"""Scans left out at the beginning; the log as it is comes first."""
OF_STEP, OF_TURN = 0.10, 0.05
EACH_STEP, EACH_TURN = 0.01, np.radians(0.3)
"""Standard deviations of the noise: shares of a step's length and turn, and m and rad a step."""
FAR, TURNED = 0.5, np.radians(5)
"""An accepted loop that is off by more (m, rad) is false."""


@dataclass(frozen=True)
class Run:
    """One log, disturbed in one way."""

    log: str
    seed: int
    """0: the odometry as it is."""
    dropped: int
    relations: Relations


@dataclass(frozen=True)
class Outcome:
    """What came of it."""

    run: Run
    error: float
    median: float
    found: int
    """Loops accepted."""
    refused: int
    false: int


def disturbed(log: LaserLog, seed: int, dropped: int) -> LaserLog:
    """A log without its first scans, and with noise of its own on every step of the odometry."""
    assert log.odometry is not None
    odometry = log.odometry
    if seed:
        rng = np.random.default_rng(seed)
        steps = relative(odometry[1:], odometry[:-1])
        length = np.hypot(steps[:, 0], steps[:, 1])[:, None]
        noise = rng.normal(size=(len(steps), 3))
        steps[:, :2] += noise[:, :2] * (OF_STEP * length + EACH_STEP)
        steps[:, 2] += noise[:, 2] * (OF_TURN * np.abs(steps[:, 2]) + EACH_TURN)
        poses = [odometry[0]]
        for step in steps:
            poses.append(compose(poses[-1], step))
        odometry = np.array(poses)
    return excerpt(dataclasses.replace(log, odometry=odometry), slice(dropped, None))


def mapped(name: str, seed: int, dropped: int, relations: Relations) -> Graph:
    """The graph of a log, disturbed."""
    log = read_log(str(find_data(f"{name}.log.gz")), ReadingOptions())
    state = SlamState.of_log(disturbed(log, seed, dropped), SlamOptions(relations=relations))
    return run_slam(state, lambda scans, keyframes: None)


def errors(name: str, graph: Graph) -> tuple[float, float]:
    """Mean and median (m) of the error on the relations; of fr-campus, RMSE and median of the ATE."""
    found = Trajectory(graph.times, graph.poses, tuple(graph.stamps))
    relations = find_data(f"{name}.relations")
    if relations is None:
        ate = trajectory_errors(found, load_reference(str(find_data(f"{name}.reference.tum"))))
        return ate.absolute_translation.rmse, ate.absolute_translation.median
    spread = relation_errors(found, read_relations(str(relations))).translation_spread
    return spread.mean, spread.median


def false_loops(graph: Graph, truth: Array) -> int:
    """Accepted loops whose relation is off the poses (S, 3) of all the log's scans, by number."""
    measured = {}
    for pair in graph.pairwise:
        measured[pair.nodes] = pair.measurement
    for joint in graph.nscan:
        centre = joint.nodes[joint.fixed]
        for node, pose in zip(joint.nodes, joint.poses, strict=True):
            measured[node, centre] = relative(joint.poses[joint.fixed], pose)
    false = 0
    for loop in graph.loops:
        if loop.accepted:
            a, b = graph.scans[list(loop.nodes)]
            off = measured[loop.nodes] - relative(truth[b], truth[a])
            false += bool(np.hypot(off[0], off[1]) > FAR or abs(wrap(off[2])) > TURNED)
    return false


def outcome(run: Run, truth: Array) -> Outcome:
    """Map and measure; `truth` (S, 3) are the poses of the undisturbed log, mapped."""
    graph = mapped(run.log, run.seed, run.dropped, run.relations)
    accepted = sum(loop.accepted for loop in graph.loops)
    error, median = errors(run.log, graph)
    return Outcome(run, error, median, accepted, len(graph.loops) - accepted, false_loops(graph, truth))


def runs(log: str, relations: Relations) -> list[Run]:
    """All runs of a log."""
    cut = [Run(log, 0, dropped, relations) for dropped in DROPPED]
    return cut + [Run(log, seed, 0, relations) for seed in range(1, SEEDS + 1)]


def document(outcomes: list[Outcome]) -> str:
    """The tables as Markdown."""
    header = ("log", "relations", "as it is", "mean", "worst", "within 1.3 ×", "loops", "refused", "false")
    rows, single = [], []
    for log, wanted in WANTED.items():
        for relations in ("both", "pairwise"):
            found = [o for o in outcomes if (o.run.log, o.run.relations) == (log, relations)]
            if not found:
                continue
            error = np.array([each.error for each in found])
            rows.append((
                log,
                relations,
                f"{error[0]:.4f} ({found[0].median:.4f})",
                f"{error[1:].mean():.4f} ({np.mean([each.median for each in found[1:]]):.4f})",
                f"{error[1:].max():.4f}",
                f"{(error[1:] <= 1.3 * wanted).sum()} of {len(found) - 1}",
                f"{np.mean([each.found for each in found]):.0f}",
                f"{np.mean([each.refused for each in found]):.0f}",
                f"{sum(each.false for each in found)}",
            ))  # fmt: skip
            single += [
                (log, relations, f"seed {o.run.seed}" if o.run.seed else f"from scan {o.run.dropped}",
                 f"{o.error:.4f}", f"{o.median:.4f}", f"{o.error / wanted:.2f}", str(o.false))
                for o in found
            ]  # fmt: skip
    parts = [
        "# Robustness",
        "Written by `make robustness`. Every log is mapped with noise on its odometry (Gaussian, anew for "
        f"each of {SEEDS} seeds: {OF_STEP:.0%} of a step's length and {OF_TURN:.0%} of its turn, and 1 cm "
        f"and 0.3° a step), and without its first {', '.join(map(str, DROPPED[1:-1]))} or {DROPPED[-1]} "
        "scans. Errors are means (medians) on the log's relations in m; for fr-campus the RMSE (median) of "
        "the ATE. Wanted are: "
        + ", ".join(f"{log} {wanted}" for log, wanted in WANTED.items())
        + ". A loop is false when it was accepted and lies 0.5 m or 5° off the map of the undisturbed log.",
        table(header, rows),
        "## Every run",
        table(("log", "relations", "disturbed", "error", "median", "of the wanted", "false loops"), single),
    ]
    return "\n\n".join(parts) + "\n"


def main(out: str, names: Sequence[str]) -> None:
    """Run all logs that are there, or those of these names, in two processes; write the document."""
    logs = [log for log in names or WANTED if find_data(f"{log}.log.gz")]
    with ProcessPoolExecutor(2) as pool:
        truths = dict(zip(logs, pool.map(undisturbed, logs), strict=True))
        todo = [run for log in logs for relations in ("both", "pairwise") for run in runs(log, relations)]
        pending = [pool.submit(outcome, run, truths[run.log]) for run in todo]
        outcomes = []
        for each in pending:
            outcomes.append(each.result())
            print(outcomes[-1], flush=True)
    Path(out).write_text(document(outcomes), encoding="utf-8")


def undisturbed(log: str) -> Array:
    """(S, 3) the poses of a log as it is."""
    return mapped(log, 0, 0, "both").poses


if __name__ == "__main__":
    # One thread a process, as the command line does it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main(sys.argv[1], sys.argv[2:])
