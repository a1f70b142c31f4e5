"""From global to local coordinates of an nScan relation (paper, IV): pose c followed, or a mapping held.

How many iterations the paper's alternatives need against the chosen mapping, on graphs of whole logs.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import Optimum, StopOptions, optimise_poses
from nscan_cli.logs.load import read_log
from nscan_cli.poses import Array, Indices, compose, relative
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.data import OFFICE_LOG, find_data
from tests.experiments.fixed_mapping import MAX_ITERATIONS, TOLERANCE, FixedMapping, VariableMapping, minimise
from tests.experiments.mappings import Mapping, mean, of_pose_c, optimal, with_c_held
from tests.experiments.report import Report
from tests.graph.simulated_relations import disturbed

REAL = ("mit-csail", "intel")
CHAIN_NOISE = np.array([0.03, 0.03, 0.015])
"""Standard deviations (m, m, rad) of the noise of each relation of a chain."""
CHAIN_SEEDS = (0, 1)
NEAR, NEAR_NOISE = "near", 0.1
"""m, and a tenth of it in rad: the noise of the poses of this start."""
OPTIMAL, FREE, C_HELD = "held: optimal", "free", "c held"
MAPPINGS: dict[str, Mapping] = {"held: of c": of_pose_c, "held: mean": mean, OPTIMAL: optimal}
FURTHER = 1000
"""Iterations at most, once, of those that need many."""

TEXT = (
    "The graphs that `slam` makes of three logs are minimised again from other poses: the odometry of the "
    "keyframes; the chain of their pairwise relations, as it is, and twice with noise of "
    f"{CHAIN_NOISE[0]:g} m and {CHAIN_NOISE[2]:g} rad in every relation; and `{NEAR}`, the minimum with "
    f"noise of {NEAR_NOISE:g} m and {NEAR_NOISE / 10:g} rad in every pose. The tool's mapping follows pose "
    "c. The others are held during an iteration and found again for the next: the mapping of pose c, the "
    "mean of those of single scans, and the optimal one, which minimises fᵗHf. Damping and the stopping "
    "rule are the same for all: a step that moves no pose by more than 1e-6 (m, rad). All steps are "
    "Gauss–Newton steps, except the last ones of the tool. A cell has the iterations, and in brackets the "
    f"energy that is left, always with the tool's mapping. `not in {MAX_ITERATIONS}` means that the limit "
    "was reached; with a smaller number, no step lowered the energy any more.\n\nWith the optimal mapping "
    'the paper saw "significantly more iterations", and more still with simpler ones. We see this if H '
    "is that with pose c held, as III-D recalculates it; the paper does not say which H it used here. Such "
    "an H ties the scans to where the held mapping puts them. They follow each other slowly, the forces on "
    f"pose c itself are lost, and they do not end in the minimum. From `{NEAR}` in the office, within "
    f"{FURTHER} iterations, {{further}}. Graphs keep H with a free gauge. Then the mapping of c and the "
    "mean one take at most two iterations more than the tool's, and end within 0.01 % of its energy. The "
    "optimal one is hardly determined, since a turn of all local poses costs nothing to first order, and "
    "leads elsewhere. From the odometry of intel, up to 60 m off, none reaches the minimum."
)


@dataclass(frozen=True)
class Problem:
    """A graph, and poses to start from."""

    name: str
    pairwise: list[Pairwise]
    nscan: list[NScan]
    positions: Indices
    chosen: VariableMapping
    starts: dict[str, Array]
    """(K, 3) each."""

    def held(self, mapping: Mapping, c_held: bool) -> FixedMapping:
        """The energy with another mapping, with the relations' Hessians, or with those for a fixed pose c."""
        nscan = [with_c_held(relation) for relation in self.nscan] if c_held else self.nscan
        return FixedMapping(len(self.chosen.free_row), self.pairwise, nscan, self.positions, mapping)


def problem_of(name: str, graph: Graph) -> Problem:
    """The graph that `slam` made of a log with odometry, optimised."""
    keyframes = graph.keyframes
    positions = np.full(len(graph), -1)
    positions[keyframes] = np.arange(len(keyframes))
    energy = VariableMapping(len(keyframes), graph.relations, positions)
    return Problem(name, graph.pairwise, graph.nscan, positions, energy, dict(_starts(graph)))


def _starts(graph: Graph) -> Iterator[tuple[str, Array]]:
    assert graph.odometry is not None
    poses, odometry = graph.poses[graph.keyframes], graph.odometry[graph.keyframes]
    yield "odometry", compose(poses[0], relative(odometry, odometry[0]))
    yield "chain", _chained(graph, np.zeros((len(poses) - 1, 3)))
    for seed in CHAIN_SEEDS:
        noise = CHAIN_NOISE * np.random.default_rng(seed).normal(size=(len(poses) - 1, 3))
        yield f"noisy chain {seed + 1}", _chained(graph, noise)
    yield NEAR, disturbed(poses, NEAR_NOISE)


def _chained(graph: Graph, noise: Array) -> Array:
    """The poses (K, 3) that the relations from keyframe to keyframe give, with noise (K − 1, 3) in each."""
    keyframes = graph.keyframes
    chain = {
        relation.nodes: relation.measurement for relation in graph.pairwise if relation.origin == "track"
    }
    poses = [graph.poses[keyframes[0]]]
    for a, b, added in zip(keyframes[:-1].tolist(), keyframes[1:].tolist(), noise, strict=True):
        poses.append(compose(poses[-1], chain[a, b] + added))
    return np.array(poses)


@functools.cache
def problems() -> tuple[Problem, ...]:
    """The graphs of the simulated office, and of the REAL logs that are there."""
    logs = {"simulated office": Path(OFFICE_LOG)} | {name: find_data(f"{name}.log.gz") for name in REAL}
    return tuple(
        problem_of(
            name, run_slam(SlamState.of_log(read_log(str(path)), SlamOptions()), lambda done, keyframes: None)
        )
        for name, path in logs.items()
        if path is not None
    )


class Minimiser(Protocol):
    """Minimises from poses (K, 3)."""

    def __call__(self, poses: Array, /, *, max_iterations: int) -> Optimum: ...


def _optimised(energy: GraphEnergy, poses: Array, /, *, max_iterations: int) -> Optimum:
    """The tool's own optimisation."""
    return optimise_poses(energy, poses, StopOptions(max_iterations, TOLERANCE))


def ways(problem: Problem) -> Iterator[tuple[str, str, Minimiser]]:
    """The mapping, the gauge in the relations' Hessians, and the function that minimises."""
    yield (
        "follows c, as in the tool",
        "either",
        functools.partial(_optimised, problem.chosen),
    )
    yield "follows c, Gauss–Newton", "either", functools.partial(minimise, problem.chosen)
    for c_held, gauge in ((False, FREE), (True, C_HELD)):
        for name, mapping in MAPPINGS.items():
            yield name, gauge, functools.partial(minimise, problem.held(mapping, c_held))


def report() -> Report:
    """The table."""
    found = problems()
    rows = []
    for problem in found:
        for name, gauge, minimised in ways(problem):
            optima = [minimised(start, max_iterations=MAX_ITERATIONS) for start in problem.starts.values()]
            rows.append([problem.name, name, gauge, *(_told(problem, optimum) for optimum in optima)])
    missing = [name for name in REAL if name not in {problem.name for problem in found}]
    return Report(
        "IV: the mapping to local coordinates, followed or held",
        TEXT.format(further=_further(found[0])),
        {},
        ("graph", "mapping", "gauge of H", *found[0].starts),
        rows,
        tuple(f"Left out: {name}, since its log is not there." for name in missing),
    )


def _told(problem: Problem, optimum: Optimum) -> str:
    """Iterations, and the energy with the chosen mapping."""
    energy = problem.chosen.evaluate(optimum.poses, exact=False).value
    if optimum.converged:
        return f"{optimum.iterations} ({energy:.5g})"
    return f"not in {optimum.iterations} ({energy:.3g})"


def _further(problem: Problem) -> str:
    """How those end from near the minimum that do not within the iterations of the table."""
    parts = []
    for name, gauge, minimised in ways(problem):
        if gauge == C_HELD or (name, gauge) == (OPTIMAL, FREE):
            optimum = minimised(problem.starts[NEAR], max_iterations=FURTHER)
            parts.append(f"`{name}`, {gauge}: {_told(problem, optimum)}")
    return "; ".join(parts)
