"""`nscan-cli slam`: a log in, a pose graph and a map out."""

from __future__ import annotations

import dataclasses
import time
from typing import TYPE_CHECKING

import click

from nscan_cli.cli.options import CONTEXT, common_options, reading_options
from nscan_cli.cli.progress import progress, say
from nscan_cli.cli.slam_outputs import Outputs
from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.inputs import label
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.provenance import provenance_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.scan import LaserLog
    from nscan_cli.slam.options import Relations, SlamOptions

MAPPING = ("max_scans", "relations", "no_loops")
"""Options that say how a log is mapped."""


@click.command("slam", context_settings=CONTEXT)
@click.argument("log", required=False)
@click.option(
    "-o", "--output", default="-", metavar="GRAPH.json", help="The graph; standard output if not given."
)
@click.option("--map", "map_file", metavar="MAP.png", help="The map too, and its YAML beside it.")
@click.option("--trajectory", metavar="OUT.tum", help="The pose of every scan in TUM's form too.")
@click.option(
    "--g2o",
    metavar="OUT.g2o",
    help="The keyframes' graph in g2o's form too, nScan relations as pairwise ones.",
)
@click.option("--carmen", metavar="OUT.log", help="The log with corrected poses in CARMEN's form too.")
@click.option(
    "--from",
    "from_file",
    metavar="GRAPH",
    help="Optimise a saved graph (JSON or g2o), and refine it again with its LOG; nothing is tracked.",
)
@click.option("--max-scans", type=click.IntRange(3), default=10, show_default=True, metavar="N",
              help="Most scans in an nScan relation.")  # fmt: skip
@click.option("--relations", type=click.Choice(["pairwise", "nscan", "both"]), default="both",
              show_default=True, help="Match scans near each other one by one (pairwise), or jointly "
              "(nscan; both: and keep the chain of tracking).")  # fmt: skip
@click.option("--no-loops", is_flag=True, help="Match nothing with what an earlier visit saw: drift stays.")
@click.option("--threads", type=click.IntRange(1), metavar="N",
              help="Work in so many threads, with the same result; by default one a processor.")  # fmt: skip
@click.option("--depfile", metavar="FILE", help="Write what the outputs were made from as a rule for make.")
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
    is read, and its scans are matched, with the options that the graph was made with. Without it the
    graph is optimised only.
    """
    if log is None and from_file is None:
        raise WrongUsageError("slam: give LOG, or --from GRAPH")
    if log == "-" and from_file == "-":
        raise WrongUsageError("standard input (-) can be one input only; give the other by its path")
    if from_file is not None and (reading != ReadingOptions() or _given(*MAPPING)):
        raise WrongUsageError(
            "slam: reading options, --max-scans, --relations and --no-loops do not go with --from; "
            "those that the graph was made with hold"
        )
    outputs = Outputs(output, map_file, trajectory, g2o, carmen, depfile)
    outputs.check([path for path in (from_file, log) if path is not None])
    from nscan_cli.threads import available_threads

    threads = threads or available_threads()
    began = time.perf_counter()
    if from_file is None:
        assert log is not None
        run = _map(log, reading, _options(max_scans, relations, no_loops), threads, quiet, verbose)
    else:
        run = _again(from_file, log, outputs.need_scans, threads, quiet)
        # A log that was found must not be replaced either.
        outputs.check(run.inputs)
    outputs.write(run.graph, run.scans, run.rows, run.inputs)
    seconds = time.perf_counter() - began
    say(run.summary, quiet)
    if from_file is None and run.scans is not None:
        rate, span = len(run.scans) / seconds, float(run.scans.times[-1] - run.scans.times[0])
        say(f"{seconds:.1f} s, {rate:.0f} scans a second, {span / seconds:.0f} times real time", quiet)


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
    summary: str


def _given(*options: str) -> bool:
    """Whether one of the options stands on the command line."""
    sources = [click.get_current_context().get_parameter_source(option) for option in options]
    return any(source is not None and source.name == "COMMANDLINE" for source in sources)


def _options(max_scans: int, relations: Relations, no_loops: bool) -> SlamOptions:
    from nscan_cli.slam.options import NScanOptions, SlamOptions

    return SlamOptions(nscan=NScanOptions(max_scans=max_scans, loops=not no_loops), relations=relations)


def _map(
    log: str, reading: ReadingOptions, options: SlamOptions, threads: int, quiet: bool, verbose: int
) -> _Run:
    """Run the whole loop over a log."""
    import numpy as np

    from nscan_cli.logs.load import read_log
    from nscan_cli.slam.pipeline import Slam

    scans = read_log(log, reading)
    for warning in scans.report.notices():
        say(f"warning: {warning}", quiet)
    _announce_compiling(quiet)
    slam = Slam(scans, options, threads)
    with progress("mapping", len(scans), quiet) as advance:
        graph = slam.run(lambda done, keyframes: advance(done, f"{keyframes} keyframes"))
    parameters = {"reading": dataclasses.asdict(reading), "slam": dataclasses.asdict(options)}
    graph.provenance = provenance_of([scans.source], parameters)
    accepted = sum(loop.accepted for loop in graph.loops)
    summary = (
        f"{len(scans)} scans, {len(graph.keyframes)} keyframes, {len(graph.pairwise)} pairwise and "
        f"{len(graph.nscan)} nScan relations\n"
        f"places seen before: {len(graph.loops)} tried, {accepted} matched, "
        f"{len(graph.loops) - accepted} refused"
    )
    if verbose:
        restarts, searches = slam.tracker.restarts, slam.tracker.searches
        summary += (
            f"\nwhile tracking: {restarts} starts from other angles, {searches} searches\n"
            f"large loops: {len(slam.places)} keyframes found at a place seen before by search"
        )
    return _Run(graph, scans, np.arange(len(scans)), [log], summary)


def _announce_compiling(quiet: bool) -> None:
    from nscan_cli.compiled import first_compile

    if first_compile():
        say("compiling the kernels, once for this version on this machine: about 20 s", quiet)


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
    scans, rows, inputs = None, np.arange(0), [path]
    if read is None:
        graph.marginals = marginal_covariances(graph)
    else:
        from nscan_cli.slam.again import refine_again

        scans, rows, log_path = read
        inputs.append(log_path)
        _announce_compiling(quiet)
        graph = refine_again(graph, scans, rows, threads)
    moved = float(np.hypot(*(graph.poses - before)[:, :2].T).max())
    summary = (
        f"{len(graph.keyframes)} keyframes, {len(graph.pairwise)} pairwise and {len(graph.nscan)} nScan "
        f"relations: energy {optimum.energy:.6g} after {optimum.iterations} iterations"
        + ("" if read is None else ", then refined")
        + f"; no pose moved by more than {moved:.3g} m"
    )
    return _Run(graph, scans, rows, inputs, summary)


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
