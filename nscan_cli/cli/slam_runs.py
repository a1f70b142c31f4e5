"""The two modes of `slam`: from a log, and from a saved graph."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.log_reader import log_reader
from nscan_cli.cli.progress import progress, say
from nscan_cli.cli.robot_toml import changed_flags
from nscan_cli.cli.slam_summary import Facts, graph_facts
from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.files.inputs import label
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.poses import Indices
    from nscan_cli.slam.consistency.options import VerificationOptions
    from nscan_cli.slam.options import SlamOptions


@dataclasses.dataclass(frozen=True)
class SlamRun:
    """The results of a run, and the facts of its summary."""

    graph: Graph
    scans: LaserLog | None
    """The graph's log, if there is one."""
    rows: Indices
    """(N,) the row of each node's scan in the log."""
    inputs: list[str]
    """The paths of all files that were read."""
    facts: Facts
    compiled: bool = False
    """Whether kernels were compiled."""


def run_on_log(
    log: Sequence[str],
    reading: ReadingOptions,
    options: SlamOptions,
    calibrated: bool,
    verification: VerificationOptions | None,
    threads: int,
    quiet: bool,
) -> SlamRun:
    """Map a log, with its robot calibrated first, and its drive mapped again, if asked."""
    import numpy as np

    from nscan_cli.kernels.decorators import load_runtime
    from nscan_cli.logs.log_files import files_of
    from nscan_cli.slam.consistency.map_verification import add_verification
    from nscan_cli.slam.log_to_graph import map_log, notices_of_mapping
    from nscan_cli.warm_up.side_by_side import is_cold

    compiling = Compiling("half a minute to a minute", quiet)
    read = log_reader(log)
    early = None
    if threads > 1 and is_cold():
        # Whatever is wrong with the log is said at once, and not after the minute of compilation.
        early = read(reading)
        compiling.beforehand_for_slam(early)
    load_runtime()
    scans = early or read(reading)
    uncalibrated: list[str] = []
    if calibrated:
        recorded = reading
        reading, uncalibrated = _calibrated(scans, reading, quiet)
        if reading != recorded:
            scans = read(reading)
    warnings = [*uncalibrated, *scans.report.notices()]
    for warning in warnings:
        say(f"warning: {warning}", quiet)
    with progress("mapping", len(scans), quiet) as bar:
        tracked = 0

        def report(done: int, keyframes: int, loops: int) -> None:
            nonlocal tracked
            if done <= tracked:
                bar.begin("mapping again with corrected odometry", len(scans))
            tracked = done
            bar.advance(done, f"{counted(keyframes, 'keyframe')}, {counted(loops, 'loop')}")
            if done == len(scans):
                # Tracking is done; the final optimisation and refinement have no known length.
                bar.begin("optimising and refining", None)

        state, graph = map_log(scans, reading, options, threads, report)
    if verification is not None:
        with progress("mapping again", None, quiet):
            add_verification(state, graph, verification, threads)
    # As the check of the file has corrected it.
    scans = dataclasses.replace(state.recorded, mapped_path=graph.path)
    later = notices_of_mapping(scans, graph)
    for warning in later:
        say(f"warning: {warning}", quiet)
    graph.provenance["notices"] += uncalibrated
    facts = graph_facts(graph) | {
        "duration": float(scans.times[-1] - scans.times[0]),
        "tracking": {
            "restarts": state.tracking_restarts,
            "searches": state.tracking_searches,
            "places": len(state.places),
        },
        "verification": graph.provenance.get("verification"),
        "warnings": [*warnings, *later],
    }
    return SlamRun(graph, scans, np.arange(len(scans)), files_of(log), facts, compiling.has_begun)


def _calibrated(scans: LaserLog, reading: ReadingOptions, quiet: bool) -> tuple[ReadingOptions, list[str]]:
    """The options that read the log as its calibration says, which are told; the same if it says nothing, and
    why."""
    from nscan_cli.calibration.calibrated_reading import calibrated_reading
    from nscan_cli.calibration.options import CalibrationOptions
    from nscan_cli.calibration.robot_calibration import calibrate

    options = CalibrationOptions()
    try:
        found = calibrated_reading(calibrate(scans, reading, options), reading, options)
    except InputDataError as error:
        return reading, [f"not calibrated: {error}"]
    say(f"calibrated: {changed_flags(reading, found) or 'the file says what the scans say'}", quiet)
    return found, []


def run_on_graph(
    path: str, log_files: Sequence[str] | None, needs_log: bool, threads: int, quiet: bool
) -> SlamRun:
    """Optimise a saved graph, and refine it if its log is found."""
    import numpy as np

    from nscan_cli.graph.io.load_graph import load_graph
    from nscan_cli.graph.marginal_covariances import marginal_covariances
    from nscan_cli.graph.optimise.whole_graph import optimise_graph

    compiling = Compiling("up to half a minute", quiet)
    notices: list[str] = []
    graph = load_graph(path, notices)
    for notice in notices:
        say(f"warning: {notice}", quiet)
    read = _graph_log(path, graph, log_files, needs_log, quiet)
    before = graph.poses
    optimum = optimise_graph(graph)
    if not optimum.converged:
        notices.append(f"{path}: the optimisation did not converge: its relations contradict each other")
        say(f"warning: {notices[-1]}", quiet)
    scans, rows, inputs = None, np.arange(0), [path]
    if read is None:
        graph.marginals = marginal_covariances(graph)
    else:
        from nscan_cli.slam.backend.resume import resume

        scans, rows, log_paths = read
        inputs += log_paths
        with progress("refining", None, quiet):
            graph = resume(graph, scans, rows, threads)
    moved = float(np.hypot(*(graph.poses - before)[:, :2].T).max())
    facts = graph_facts(graph) | {
        "optimised": {
            "energy": optimum.energy,
            "iterations": optimum.iterations,
            "refined": read is not None,
            "moved": moved,
        },
        "warnings": notices,
    }
    return SlamRun(graph, scans, rows, inputs, facts, compiling.has_begun)


def _graph_log(
    path: str, graph: Graph, log_files: Sequence[str] | None, needed: bool, quiet: bool
) -> tuple[LaserLog, Indices, list[str]] | None:
    """The log of a saved graph, the rows of its scans, and its files' paths; None without a log."""
    from nscan_cli.cli.graph_log import find_log, read_graph_log
    from nscan_cli.logs.log_files import files_of
    from nscan_cli.slam.backend.guessed_steps import guesses_of
    from nscan_cli.slam.backend.resume import can_refine, options_of

    if not can_refine(graph):
        if needed or log_files is not None:
            raise WrongUsageError(
                f"slam: {path} was not made from a log by slam; leave out LOG, --map and --carmen"
            )
        say(f"{path}: was not made from a log by slam: it is optimised but not refined", quiet)
        return None
    place = "provenance.parameters"
    try:
        options_of(graph)
        place = "provenance"
        guesses_of(graph)
    except ValueError as error:
        raise InputDataError(
            label(path), f"{place}: {error}", "correct it, or create the graph again"
        ) from error
    try:
        log_files = find_log(path, graph) if log_files is None else log_files
    except InputMissingError as error:
        if needed:
            raise
        say(f"warning: optimised but not refined: {error}", quiet)
        return None
    scans, _nodes, rows = read_graph_log(path, graph, log_files, ReadingOptions())
    return scans, rows, files_of(log_files)
