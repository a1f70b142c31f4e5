"""`nscan-cli slam`: a log in, a pose graph and a map out."""

from __future__ import annotations

import dataclasses
import re
import sys
import time
from collections import Counter
from typing import TYPE_CHECKING

import click

from nscan_cli.cli.command import FILE, log_argument, option, subcommand
from nscan_cli.cli.options import common_options, reading_options
from nscan_cli.cli.progress import announce_compiling, progress, say
from nscan_cli.cli.slam_outputs import Outputs
from nscan_cli.cli.summary import Row, table
from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.inputs import label
from nscan_cli.logs.options import ReadingOptions

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.scan import LaserLog
    from nscan_cli.slam.options import Relations, SlamOptions

MAPPING = ("max_scans", "relations", "no_loops")
"""Options that say how a log is mapped."""


@subcommand(
    "slam",
    ("nscan-cli slam robot.log.gz -o robot.json --map robot.png", "a graph, a map and its YAML"),
    ("nscan-cli slam robot.mcap --no-odometry -o robot.json", "by the laser alone"),
    ("nscan-cli slam robot.log.gz -o robot.json --depfile robot.d", "in a Makefile"),
    ("nscan-cli slam --from robot.json -o refined.json", "a saved graph, optimised and refined again"),
)
@log_argument(required=False)
@option(
    "-o",
    "--output",
    type=FILE,
    default="-",
    metavar="GRAPH.json",
    help="The graph; standard output if not given.",
)
@option("--map", "map_file", type=FILE, metavar="MAP.png", help="The map too, and MAP.yaml beside it.")
@option("--trajectory", type=FILE, metavar="OUT.tum", help="The pose of every scan too, in TUM's form.")
@option(
    "--g2o",
    type=FILE,
    metavar="OUT.g2o",
    help="The keyframes' graph too, in g2o's form; nScan relations become pairwise ones.",
)
@option("--carmen", type=FILE, metavar="OUT.log", help="The log with corrected poses too, in CARMEN's form.")
@option(
    "--from",
    "from_file",
    type=FILE,
    metavar="GRAPH",
    help="Optimise a saved graph (JSON or g2o) and refine it with its LOG; nothing is tracked.",
)
@option(
    "--max-scans",
    type=click.IntRange(3),
    default=10,
    show_default=True,
    metavar="N",
    help="Most scans in an nScan relation.",
)
@option(
    "--relations",
    type=click.Choice(["pairwise", "nscan", "both"]),
    default="both",
    show_default=True,
    help="Match scans near each other one by one (pairwise) or jointly (nscan); both is nscan with the "
    "whole chain of tracking.",
)
@option("--no-loops", is_flag=True, help="Match nothing with what an earlier visit saw: drift stays.")
@option(
    "--threads",
    type=click.IntRange(1),
    metavar="N",
    help="Work in so many threads, one a processor if not given; the result is the same.",
)
@option(
    "--depfile", type=FILE, metavar="FILE", help="Write what the outputs were made from as a rule for make."
)
@reading_options
@common_options
def command(
    log: str | None,
    output: str,
    map_file: str | None,
    trajectory: str | None,
    g2o: str | None,
    carmen: str | None,
    from_file: str | None,
    max_scans: int,
    relations: Relations,
    no_loops: bool,
    threads: int | None,
    depfile: str | None,
    reading: ReadingOptions,
    quiet: bool,
    verbose: int,
) -> None:
    """Turn LOG into a globally consistent pose graph, and a map if asked.

    Every scan gets a pose: tracked against the map of the last metres, then moved along with its
    keyframe when the graph of pairwise and nScan relations is optimised.

    With --from, LOG is looked for beside the graph, then in the current folder, when it is not given; it
    is read, and its scans are matched, with the options that the graph was made with. When it is not
    there, the graph is optimised only.
    """
    if log is None and from_file is None:
        raise WrongUsageError("slam: give LOG, or --from GRAPH")
    if output == "-" and not _given("output") and sys.stdout is not None and sys.stdout.isatty():
        raise WrongUsageError("slam: the graph is long; give -o GRAPH.json, or -o - to see it here")
    if log == "-" and from_file == "-":
        raise WrongUsageError("standard input (-) can be one input only; give the other by its path")
    if from_file is not None and (reading != ReadingOptions() or _given(*MAPPING)):
        raise WrongUsageError(
            "slam: reading options, --max-scans, --relations and --no-loops do not go with --from; "
            "those that the graph was made with hold"
        )
    outputs = Outputs(output, map_file, trajectory, g2o, carmen, depfile)
    outputs.check([path for path in (from_file, log) if path is not None])
    from nscan_cli.slam.run import slam_options
    from nscan_cli.threads import available_threads

    threads = threads or available_threads()
    began = time.perf_counter()
    if from_file is None:
        assert log is not None
        run = _map(log, reading, slam_options(max_scans, relations, not no_loops), threads, quiet, verbose)
    else:
        run = _again(from_file, log, outputs.need_scans, threads, quiet)
        # A log that was found must not be replaced either.
        outputs.check(run.inputs)
    outputs.write(run.graph, run.scans, run.rows, run.inputs, threads)
    seconds = time.perf_counter() - began
    took = [f"{seconds:.1f} s" + (", the kernels' compilation included" if run.compiled else "")]
    if from_file is None and run.scans is not None and not run.compiled:
        rate, span = len(run.scans) / seconds, float(run.scans.times[-1] - run.scans.times[0])
        took = [f"{took[0]}, {rate:.0f} scans a second, {span / seconds:.0f} times real time"]
    say(table([*run.summary, ("time", took), ("written", [", ".join(outputs.files())])]), quiet)


@dataclasses.dataclass(frozen=True)
class _Run:
    """What there is to write and to say."""

    graph: Graph
    scans: LaserLog | None
    """The graph's log, where there is one."""
    rows: NDArray[np.int64]
    """(N,) the rows of its scans."""
    inputs: list[str]
    """The paths that were read."""
    summary: list[Row]
    compiled: bool = False
    """Whether the kernels had to be compiled first."""


def _given(*options: str) -> bool:
    """Whether one of the options stands on the command line."""
    sources = [click.get_current_context().get_parameter_source(option) for option in options]
    return any(source is not None and source.name == "COMMANDLINE" for source in sources)


def _map(
    log: str, reading: ReadingOptions, options: SlamOptions, threads: int, quiet: bool, verbose: int
) -> _Run:
    """Run the whole loop over a log."""
    import numpy as np

    from nscan_cli.logs.load import read_log
    from nscan_cli.slam.run import map_log, notices

    scans = read_log(log, reading)
    for warning in scans.report.notices():
        say(f"warning: {warning}", quiet)
    compiled = announce_compiling("match_and_count", quiet)
    with progress("mapping", len(scans), quiet) as advance:

        def report(done: int, keyframes: int, loops: int) -> None:
            last = ", closing up" if done == len(scans) else ""
            advance(done, f"{keyframes} keyframes, {loops} loops{last}")

        slam, graph = map_log(scans, reading, options, threads, report)
    for warning in notices(slam):
        say(f"warning: {warning}", quiet)
    summary: list[Row] = [
        ("scans", [f"{len(scans)} in {float(scans.times[-1] - scans.times[0]):.1f} s"]),
        *_graph_rows(graph),
    ]
    if verbose:
        tracker = slam.tracker
        summary += [
            ("tracking", [f"{tracker.restarts} starts from other angles, {tracker.searches} searches"]),
            ("large loops", [f"{len(slam.places)} keyframes found by search at a place seen before"]),
        ]
    return _Run(graph, scans, np.arange(len(scans)), [log], summary, compiled)


def _graph_rows(graph: Graph) -> list[Row]:
    """What a graph is made of, and why loops were refused."""
    from nscan_cli.slam.run import Counts

    counts = Counts.of(graph)
    tried, refused = counts.accepted + counts.refused.total(), counts.refused.total()
    reasons: Counter[str] = Counter()
    for reason, count in counts.refused.items():
        # Alike but for a number of scans.
        reasons[re.sub(r"\d+", "some", reason)] += count
    return [
        ("keyframes", [f"{counts.keyframes}"]),
        ("relations", [f"{counts.pairwise} pairwise, {counts.nscan} nScan"]),
        (
            "loops",
            [f"{tried} tried, {counts.accepted} accepted, {refused} refused" if tried else "none tried"],
        ),
        ("refused", [f"{count}: {reason}" for reason, count in reasons.most_common()]),
    ]


def _again(path: str, log_file: str | None, needs_log: bool, threads: int, quiet: bool) -> _Run:
    """Optimise a saved graph, and refine it where its log is there."""
    import numpy as np

    from nscan_cli.graph.load import load_graph
    from nscan_cli.graph.marginals import marginal_covariances
    from nscan_cli.graph.solve import optimise_graph

    graph = load_graph(path)
    read = _log_of(path, graph, log_file, needs_log, quiet)
    before = graph.poses
    optimum = optimise_graph(graph)
    if not optimum.converged:
        say(f"warning: {path}: the optimum was not reached, its relations contradict each other", quiet)
    scans, rows, inputs, compiled = None, np.arange(0), [path], False
    if read is None:
        graph.marginals = marginal_covariances(graph)
    else:
        from nscan_cli.slam.again import refine_again

        scans, rows, log_path = read
        inputs.append(log_path)
        compiled = announce_compiling("match_and_count", quiet)
        graph = refine_again(graph, scans, rows, threads)
    moved = float(np.hypot(*(graph.poses - before)[:, :2].T).max())
    refined = "" if read is None else ", then refined"
    outcome = f"energy {optimum.energy:.6g} after {optimum.iterations} iterations{refined}"
    summary: list[Row] = [
        *_graph_rows(graph),
        ("optimised", [outcome]),
        ("moved", [f"no pose by more than {moved:.3g} m"]),
    ]
    return _Run(graph, scans, rows, inputs, summary, compiled)


def _log_of(
    path: str, graph: Graph, log_file: str | None, needed: bool, quiet: bool
) -> tuple[LaserLog, NDArray[np.int64], str] | None:
    """The log of a saved graph, the rows of its scans, and its path; None where the graph has none."""
    from nscan_cli.cli.graph_log import find_log, read_graph_log
    from nscan_cli.slam.again import can_refine, options_of

    if not can_refine(graph):
        if needed or log_file is not None:
            raise WrongUsageError(
                f"slam: {path} is no graph that slam made from a log; leave out LOG, --map and --carmen"
            )
        say(f"{path}: is no graph that slam made from a log: it is optimised only", quiet)
        return None
    try:
        options_of(graph)
    except ValueError as error:
        raise InputDataError(
            label(path), f"provenance.parameters: {error}", "mend it, or write it again"
        ) from error
    try:
        log_file = find_log(path, graph) if log_file is None else log_file
    except InputMissingError as error:
        if needed:
            raise
        say(f"warning: optimised only, and not refined: {error}", quiet)
        return None
    scans, _nodes, rows = read_graph_log(path, graph, log_file, ReadingOptions())
    return scans, rows, log_file
