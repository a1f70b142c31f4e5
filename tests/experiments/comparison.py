"""The comparison that the paper does not make: joint matching against pairs, over many drawn problems."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.matching.joint.joint_energy import JointProblem, all_pairs, no_priors
from nscan_cli.matching.joint.joint_match import match_near_and_far
from nscan_cli.matching.joint.nscan_match import nscan_match
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.pairwise import PairMatch, match_pair
from nscan_cli.poses import Array, compose, relative
from tests.experiments.charts import line_chart
from tests.experiments.drawing import ERROR, Drawn, draw_real, draw_simulated
from tests.experiments.reference_logs import reference_log
from tests.experiments.report import Report
from tests.matching.problems import OPTIONS, errors
from tests.simulation.scenes import corridor_and_room, office

EACH, SEED = 120, 2006
"""Problems from each floor or log."""
METRES, DEGREES = 0.1, 1.0
"""A problem is solved when no pose has a greater error (m, °)."""
BINS = np.array([ERROR[0], 0.3, 0.5, 0.8, 1.1, ERROR[1]])
"""Of the error of the start, m."""
ENOUGH = 0.5
"""Least overlap on a tree that connects the scans of a problem at the true poses, and least overlap of a
pairwise match that enters (b)."""

TEXT = (
    "{count} problems, drawn with a fixed seed, of 3 to 10 scans each: half of them along the path, 0.3 to "
    "1.2 m apart, half from one place at any time. In a problem every scan starts off the truth by the "
    "same distance, in any direction, and by the same angle, to either side: between 0.1 m with 2° and 1.5 "
    "m with 30°. Nothing else is known: no odometry, no prior. The truth is the simulated one, or that of "
    "the reference relations of Kümmerle et al. 2009 by least squares, which agree with each other to "
    f"about 1 cm. A problem is solved if all poses lie within {METRES} m and {DEGREES:g}° of the truth, "
    "relative to the first scan. All methods use the same Gaussians. (a) matches each scan with the one "
    "before it. (b) matches all pairs in both directions, keeps those that overlap by at least "
    f"{ENOUGH:.0%} (with all of them it solves fewer), and optimises the graph of their relations. (c) is "
    "`nscan`, without and with its search for scans whose start leads nowhere. Overlap is enough if, at "
    f"the true poses, overlaps of at least {ENOUGH:.0%} of a scan's points connect all scans of the "
    "problem. The error is the root mean square of the positions of a problem's scans. Its median over all "
    "problems tells whether a method mostly works; that over the problems that all methods solve tells how "
    "exact it is."
)

CHAIN, PAIRS, START, NSCAN = "(a) chain", "(b) all pairs, graph", "(c) nScan, no search", "(c) nScan"


def chained(problem: Drawn) -> Array:
    """(a) Each scan matched with the one before it."""
    poses = [problem.start[0]]
    for scan in range(1, len(problem.start)):
        poses.append(compose(poses[-1], _pair(problem, scan - 1, scan).pose))
    return np.array(poses)


def by_graph(problem: Drawn) -> Array:
    """(b) Every scan matched with every other, both ways round, and the graph of the pairs optimised."""
    n = len(problem.start)
    relations = []
    for i, j in all_pairs(n).tolist():
        match = _pair(problem, i, j)
        if match.covariance is not None and match.overlap >= ENOUGH:
            relations.append(Pairwise((i, j), match.pose, match.hessian, "nscan", match.overlap))
    stamps = [str(scan) for scan in range(n)]
    graph = Graph(np.arange(n), stamps, chained(problem), None, np.arange(n), pairwise=relations)
    optimise_graph(graph)
    return graph.poses


def from_start(problem: Drawn) -> Array:
    """(c) The joint match as it is from the start alone."""
    n = len(problem.start)
    joint = JointProblem(
        scan_set(problem.ndts, problem.points), all_pairs(n), no_priors(), 2 * OPTIONS.scale / n
    )
    return match_near_and_far(joint, problem.start, JointOptions()).poses


def by_nscan(problem: Drawn) -> Array | None:
    """(c) What `nscan` gives; None when it leaves scans out."""
    match, left_out = nscan_match(
        problem.points, problem.start, lambda _kept: no_priors(), 0, OPTIONS, JointOptions()
    )
    return None if match is None or left_out else match.poses


METHODS: dict[str, Callable[[Drawn], Array | None]] = {
    CHAIN: chained,
    PAIRS: by_graph,
    START: from_start,
    NSCAN: by_nscan,
}


@dataclass(frozen=True)
class Results:
    """What the methods made of P problems."""

    problems: list[Drawn]
    solved: dict[str, NDArray[np.bool_]]
    """(P,) bool"""
    off: dict[str, Array]
    """(P,) root mean square of the errors of the positions, m, seen from the first scan."""

    def chosen(self, which: NDArray[np.bool_]) -> Results:
        """Those of some problems."""
        problems = [problem for problem, here in zip(self.problems, which, strict=True) if here]
        return Results(
            problems,
            {name: values[which] for name, values in self.solved.items()},
            {name: values[which] for name, values in self.off.items()},
        )


def compare(problems: list[Drawn]) -> Results:
    """All methods on all problems."""
    solved: dict[str, list[bool]] = {name: [] for name in METHODS}
    off: dict[str, list[float]] = {name: [] for name in METHODS}
    for problem in problems:
        for name, method in METHODS.items():
            poses = method(problem)
            wrong = errors(problem.start if poses is None else poses, problem.truth)
            metres = np.hypot(wrong[1:, 0], wrong[1:, 1])
            degrees = np.degrees(np.abs(wrong[1:, 2]))
            solved[name].append(bool(metres.max() <= METRES and degrees.max() <= DEGREES))
            off[name].append(float(np.sqrt((metres**2).mean())))
    return Results(
        problems,
        {name: np.array(values) for name, values in solved.items()},
        {name: np.array(values) for name, values in off.items()},
    )


@functools.cache
def results() -> dict[str, Results]:
    """By floor or log; a log that is not there is missing."""
    found = {
        f"{scene.name} (simulated)": compare(draw_simulated(scene, EACH, SEED))
        for scene in (office(), corridor_and_room())
    }
    for name in ("intel", "fr079"):
        log = reference_log(name)
        if log is not None:
            found[name] = compare(draw_real(log, EACH, SEED))
    return found


def report() -> Report:
    """Table and plot of success."""
    parts = results()
    every = _joined(list(parts.values()))
    enough = np.array([problem.link >= ENOUGH for problem in every.problems])
    bins = np.digitize([problem.error for problem in every.problems], BINS[1:-1])
    rows = [
        _row(f"starts {BINS[k]:g} to {BINS[k + 1]:g} m off", every.chosen(bins == k))
        for k in range(len(BINS) - 1)
    ]
    rows += [_row(name, part) for name, part in parts.items()]
    rows += [_row("overlap enough to match", every.chosen(enough)), _row("all", every)]
    failed = every.chosen(enough & np.logical_not(every.solved[PAIRS]))
    rows.append(_row("overlap enough, (b) fails", failed))
    common = every.chosen(np.all(list(every.solved.values()), axis=0))
    for name, part in (("all", every), ("those that all four solve", common)):
        medians = [f"{1000 * float(np.median(part.off[method])):.1f} mm" for method in METHODS]
        rows.append([f"median error, {name}", str(len(part.problems)), *medians])
    middles = 0.5 * (BINS[:-1] + BINS[1:])
    series = {
        name: (middles, np.array([100 * solved[bins == k].mean() for k in range(len(middles))]))
        for name, solved in every.solved.items()
    }
    chart = line_chart(series, "error of the start, m", "solved, %", "Success against the error of the start")
    return Report(
        "Joint matching against pairs",
        TEXT.format(count=len(every.problems)),
        {"comparison": chart},
        ("problems", "number", *METHODS),
        rows,
        tuple(
            f"Left out: {name}, since its log is not there."
            for name in ("intel", "fr079")
            if name not in parts
        ),
    )


def _pair(problem: Drawn, i: int, j: int) -> PairMatch:
    """Scan j matched with scan i."""
    start = relative(problem.start[j], problem.start[i])
    return match_pair(problem.ndts[i], problem.points[j], start, None, OPTIONS)


def _row(name: str, part: Results) -> list[str]:
    shares = [f"{part.solved[method].mean():.0%}" for method in METHODS]
    return [name, str(len(part.problems)), *shares]


def _joined(parts: list[Results]) -> Results:
    return Results(
        [problem for part in parts for problem in part.problems],
        {name: np.concatenate([part.solved[name] for part in parts]) for name in METHODS},
        {name: np.concatenate([part.off[name] for part in parts]) for name in METHODS},
    )
