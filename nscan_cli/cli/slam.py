"""`nscan-cli slam`: a log in, a pose graph and a map out."""

from __future__ import annotations

import dataclasses
import os
import time
from typing import TYPE_CHECKING, Any

import click

from nscan_cli.cli.options import CONTEXT, common_options, reading_options
from nscan_cli.cli.output import check_writable, write_whole
from nscan_cli.cli.progress import progress, say
from nscan_cli.cli.render import check_map_outputs, write_map, yaml_path
from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.provenance import provenance_of

if TYPE_CHECKING:
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
@click.option("--g2o", metavar="OUT.g2o", help="The keyframes' graph in g2o's form too.")
@click.option(
    "--from",
    "from_file",
    metavar="GRAPH",
    help="Optimise a saved graph (JSON or g2o) again, instead of mapping LOG.",
)
@click.option("--max-scans", type=click.IntRange(3), default=10, show_default=True, metavar="N",
              help="Most scans in an nScan relation.")  # fmt: skip
@click.option("--relations", type=click.Choice(["pairwise", "nscan", "both"]), default="both",
              show_default=True, help="Match scans near each other one by one (pairwise), or jointly "
              "(nscan; both: and keep the chain of tracking).")  # fmt: skip
@click.option("--no-loops", is_flag=True, help="Match nothing with what an earlier visit saw: drift stays.")
@click.option("--depfile", metavar="FILE", help="Write what the outputs were made from as a rule for make.")
@reading_options
@common_options
def command(
    log: str | None,
    output: str,
    map_file: str | None,
    trajectory: str | None,
    g2o: str | None,
    from_file: str | None,
    max_scans: int,
    relations: Relations,
    no_loops: bool,
    depfile: str | None,
    reading: ReadingOptions,
    quiet: bool,
    verbose: int,
) -> None:
    """Turn LOG into a globally consistent pose graph, and a map if asked.

    Every scan gets a pose: tracked against the map of the last metres, then moved along with its
    keyframe when the graph of pairwise and nScan relations is optimised.
    """
    if (log is None) == (from_file is None):
        raise WrongUsageError("slam: give either LOG or --from GRAPH")
    if from_file is not None and map_file is not None:
        raise WrongUsageError("slam: --map goes with LOG; draw a saved graph by render GRAPH.json LOG")
    if from_file is not None and (reading != ReadingOptions() or _given(*MAPPING)):
        raise WrongUsageError(
            "slam: reading options, --max-scans, --relations and --no-loops go with LOG; "
            "--from only optimises"
        )
    if "-" in (map_file, trajectory, g2o, depfile):
        raise WrongUsageError("slam: only the graph (-o) can go to standard output; name files for the rest")
    _check_outputs(log or from_file or "", output, map_file, trajectory, g2o, depfile)
    began = time.perf_counter()
    if log is not None:
        scans, graph, summary = _map(log, reading, _options(max_scans, relations, no_loops), quiet, verbose)
    elif from_file is not None:
        scans, graph, summary = None, *_again(from_file, quiet)
    _write(graph, output, trajectory, g2o)
    if map_file is not None and scans is not None:
        import numpy as np

        from nscan_cli.mapping.occupancy import occupancy_grid

        write_map(map_file, occupancy_grid(scans, np.arange(len(scans)), graph.poses), yaml=True)
    if depfile is not None:
        maps = [] if map_file is None else [map_file, yaml_path(map_file)]
        _write_rule(depfile, [output, *maps, trajectory, g2o], log or from_file or "")
    seconds = time.perf_counter() - began
    say(summary, quiet)
    if scans is not None:
        rate, span = len(scans) / seconds, float(scans.times[-1] - scans.times[0])
        say(f"{seconds:.1f} s, {rate:.0f} scans a second, {span / seconds:.0f} times real time", quiet)


def _given(*options: str) -> bool:
    """Whether one of the options stands on the command line."""
    sources = [click.get_current_context().get_parameter_source(option) for option in options]
    return any(source is not None and source.name == "COMMANDLINE" for source in sources)


def _options(max_scans: int, relations: Relations, no_loops: bool) -> SlamOptions:
    from nscan_cli.slam.options import NScanOptions, SlamOptions

    return SlamOptions(nscan=NScanOptions(max_scans=max_scans, loops=not no_loops), relations=relations)


def _check_outputs(source: str, output: str, map_file: str | None, *others: str | None) -> None:
    """Refuse outputs that can never be written, that share a name, or that would replace the input."""
    names = [path for path in (output, map_file, *others) if path not in (None, "-")]
    if map_file is not None:
        check_map_outputs(map_file, yaml=True)
        names.append(yaml_path(map_file))
    files = [os.path.realpath(str(name)) for name in names]
    if len(set(files)) < len(files):
        raise WrongUsageError("slam: two outputs have the same name; give each its own")
    if source != "-" and os.path.realpath(source) in files:
        raise WrongUsageError(f"slam: {source} is the input, and an output too; choose another name for it")
    for path in (output, *others):
        check_writable(path)


def _map(
    log: str, reading: ReadingOptions, options: SlamOptions, quiet: bool, verbose: int
) -> tuple[LaserLog, Graph, str]:
    """Run the whole loop over a log."""
    from nscan_cli.compiled import first_compile
    from nscan_cli.logs.load import read_log
    from nscan_cli.slam.pipeline import Slam

    scans = read_log(log, reading)
    for warning in scans.report.notices():
        say(f"warning: {warning}", quiet)
    if first_compile():
        say("compiling the kernels, once for this version on this machine: about 20 s", quiet)
    slam = Slam(scans, options)
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
    return scans, graph, summary


def _again(path: str, quiet: bool) -> tuple[Graph, str]:
    """Optimise a saved graph."""
    from nscan_cli.graph.load import load_graph
    from nscan_cli.graph.marginals import marginal_covariances
    from nscan_cli.graph.solve import optimise_graph

    graph = load_graph(path)
    optimum = optimise_graph(graph)
    graph.marginals = marginal_covariances(graph)
    if not optimum.converged:
        say(f"warning: {path}: the optimum was not reached, its relations contradict each other", quiet)
    return graph, (
        f"{len(graph.keyframes)} keyframes, {len(graph.pairwise)} pairwise and {len(graph.nscan)} nScan "
        f"relations: energy {optimum.energy:.6g} after {optimum.iterations} iterations"
    )


def _write(graph: Graph, output: str, trajectory: str | None, g2o: str | None) -> None:
    from nscan_cli.graph.json_file import write_graph

    write_whole(output, write_graph(graph))
    if trajectory is not None:
        from nscan_cli.graph.tum import write_tum

        write_whole(trajectory, write_tum(graph.stamps, graph.poses))
    if g2o is not None:
        from nscan_cli.graph.g2o import write_g2o

        write_whole(g2o, write_g2o(graph))


def _write_rule(depfile: str, outputs: list[Any], source: str) -> None:
    """`outputs: source` for make's include, with spaces and dollars escaped."""

    def escaped(path: str) -> str:
        return path.replace("$", "$$").replace(" ", "\\ ").replace("#", "\\#")

    targets = " ".join(escaped(path) for path in outputs if path not in (None, "-"))
    # Standard input is no file that make could look for.
    prerequisite = "" if source == "-" else f" {escaped(source)}"
    write_whole(depfile, f"{targets}:{prerequisite}\n".encode())
