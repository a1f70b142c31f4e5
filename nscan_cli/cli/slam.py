"""`nscan-cli slam`: from a log to a pose graph and a map."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

import click

from nscan_cli.cli.map_output import resolution_option
from nscan_cli.cli.progress import say
from nscan_cli.cli.shared_options import common_options, reading_options
from nscan_cli.cli.slam_outputs import SlamOutputs
from nscan_cli.cli.slam_summary import facts_lines
from nscan_cli.cli.standard_streams import print_json
from nscan_cli.cli.subcommand import PATH, json_option, log_argument, option, subcommand
from nscan_cli.errors import CheckFailedError, WrongUsageError
from nscan_cli.files.inputs import label
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.slam.options import Relations

MAPPING_OPTIONS = ("max_scans", "relations", "no_loops", "calibrate", "verify", "verify_bound")
"""Options of mapping a log; they do not go with --from."""


@subcommand(
    "slam",
    ("nscan-cli slam robot.log.gz -o robot.json --map robot.png", "a graph, a map and its YAML"),
    ("nscan-cli slam robot.mcap --no-odometry -o robot.json", "without odometry"),
    ("nscan-cli slam my_bag/ -o my_bag.json", "a folder written by `ros2 bag record`"),
    ("nscan-cli slam robot.log.gz -o robot.json --depfile robot.d", "with a rule for make"),
    ("nscan-cli slam --from robot.json -o refined.json", "a saved graph, optimised and refined"),
    ("nscan-cli slam robot.log.gz -o robot.json --json | jq .sigma.max", "one value, for a script"),
    ("nscan-cli slam robot.log.gz -o robot.json --verify-bound 0.5", "as a test: exit code 3 if it fails"),
)
@log_argument(required=False)
@option("-o", "--output", type=PATH, default="-", metavar="GRAPH.json",
        help="File for the graph. Default: standard output.")  # fmt: skip
@option("--map", "map_file", type=PATH, metavar="MAP.png",
        help="Also write the map (PNG or PGM), and MAP.yaml.")  # fmt: skip
@resolution_option
@option("--trajectory", type=PATH, metavar="OUT.tum", help="Also write the pose of every scan in TUM format.")
@option("--g2o", type=PATH, metavar="OUT.g2o",
        help="Also write the graph of keyframes in g2o format; nScan relations become pairwise "
        "edges.")  # fmt: skip
@option("--carmen", type=PATH, metavar="OUT.log",
        help="Also write the log with corrected poses in CARMEN format.")  # fmt: skip
@option("--from", "from_file", type=PATH, metavar="GRAPH",
        help="Optimise a saved graph (JSON or g2o), and refine it with its LOG, without "
        "tracking.")  # fmt: skip
@option("--max-scans", type=click.IntRange(3), default=10, show_default=True, metavar="N",
        help="Maximum number of scans in an nScan relation.")  # fmt: skip
@option("--relations", type=click.Choice(["pairwise", "nscan", "both"]), default="both", show_default=True,
        help="Relations of neighbouring keyframes: pairwise matches, joint matches (nscan), or joint matches "
        "plus the chain of tracked relations (both).")  # fmt: skip
@option("--calibrate", is_flag=True,
        help="First find and use the mounting, and the scale and clock of odometry.")  # fmt: skip
@option("--no-loops", is_flag=True, help="Do not close loops: drift remains.")
@option("--verify", is_flag=True,
        help="Map the drive again in ways that must give the same map; print the differences.")  # fmt: skip
@option("--verify-bound", type=click.FloatRange(0, min_open=True), metavar="M",
        help="Like --verify; exit with code 3 if a difference is larger.")  # fmt: skip
@option("--threads", type=click.IntRange(1), metavar="N",
        help="Number of threads. Default: one per processor. The result does not depend on it.")  # fmt: skip
@option("--depfile", type=PATH, metavar="FILE",
        help="Also write the inputs of all outputs as a rule for make.")  # fmt: skip
@json_option
@reading_options
@common_options
def command(
    log: tuple[str, ...],
    output: str,
    map_file: str | None,
    resolution: float,
    trajectory: str | None,
    g2o: str | None,
    carmen: str | None,
    from_file: str | None,
    max_scans: int,
    relations: Relations,
    calibrate: bool,
    no_loops: bool,
    verify: bool,
    verify_bound: float | None,
    threads: int | None,
    depfile: str | None,
    as_json: bool,
    reading: ReadingOptions,
    quiet: bool,
    verbose: int,
) -> None:
    """Build a globally consistent pose graph from LOG, and a map with --map.

    Every scan gets a pose: it is tracked against a local map, and moves with its keyframe when the graph of
    pairwise and nScan relations is optimised.

    With --from and without LOG, the log is looked for beside the graph, then in the current folder. It is
    read and matched with the options that the graph was made with. If the log is not found, the graph is
    optimised but not refined.

    With --json the summary goes to standard output as JSON, and the graph to a file.
    """
    if not log and from_file is None:
        raise WrongUsageError("slam: give LOG, or --from GRAPH")
    if output == "-" and not _given("output") and sys.stdout is not None and sys.stdout.isatty():
        raise WrongUsageError("slam: the graph is long; give -o GRAPH.json, or -o - to see it here")
    if output == "-" and as_json:
        raise WrongUsageError("slam: --json prints the summary to standard output; give -o GRAPH.json, too")
    if map_file is None and _given("resolution"):
        raise WrongUsageError("slam: --resolution is that of the map; give --map MAP.png, too")
    if "-" in log and from_file == "-":
        raise WrongUsageError("standard input (-) can be one input only; give the other by its path")
    if from_file is not None and (reading != ReadingOptions() or _given(*MAPPING_OPTIONS)):
        raise WrongUsageError(
            "slam: reading options, --max-scans, --relations, --calibrate, --no-loops and --verify cannot be "
            "combined with --from; the graph keeps its own"
        )
    outputs = SlamOutputs(output, map_file, resolution, trajectory, g2o, carmen, depfile)
    from nscan_cli.cli.slam_runs import run_on_graph, run_on_log
    from nscan_cli.logs.log_files import files_of

    named = [*([] if from_file is None else [from_file]), *(files_of(log) if log else ())]
    outputs.check(named)
    from nscan_cli.memory import use_one_arena
    from nscan_cli.slam.consistency.options import VerificationOptions
    from nscan_cli.slam.log_to_graph import slam_options
    from nscan_cli.threads import available_threads

    threads = threads or available_threads()
    use_one_arena()
    began = time.perf_counter()
    if from_file is None:
        options = slam_options(max_scans, relations, not no_loops)
        repeated = VerificationOptions(bound=verify_bound) if verify or verify_bound is not None else None
        run = run_on_log(log, reading, options, calibrate, repeated, threads, quiet)
    else:
        run = run_on_graph(from_file, log or None, outputs.need_scans, threads, quiet)
        # The log that was found must not be replaced, either.
        outputs.check(run.inputs)
    outputs.write(run.graph, run.scans, run.rows, run.inputs, threads, quiet)
    facts = run.facts | {
        "seconds": round(time.perf_counter() - began, 3),
        "compiled": run.compiled,
        "written": outputs.files(),
    }
    if as_json:
        print_json(facts)
    else:
        say(facts_lines(facts, verbose > 0), quiet)
    _check_bound(run.inputs[0], facts["verification"])


def _check_bound(name: str, verification: dict[str, Any] | None) -> None:
    """Raises CheckFailedError if maps of the same drive differ by more than --verify-bound."""
    if verification is None or verification["bound"] is None:
        return
    greatest, bound = verification["greatest"], verification["bound"]
    if greatest is None or greatest > bound:
        said = "no maps could be compared" if greatest is None else f"maps differ by {greatest:.3f} m"
        raise CheckFailedError(f"{label(name)}: {said}, and --verify-bound is {bound:g} m")


def _given(*options: str) -> bool:
    """Whether one of the options was given on the command line."""
    sources = [click.get_current_context().get_parameter_source(option) for option in options]
    return any(source is not None and source.name == "COMMANDLINE" for source in sources)
