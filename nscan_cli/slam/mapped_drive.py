"""A drive is mapped, and again where its map shows what is wrong with its odometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.agreeing_odometry import agreeing
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.clock_by_map import clock_by_map
from nscan_cli.slam.contradictions_by_map import contradictions_by_map
from nscan_cli.slam.odometry_gaps import BridgedGap, bridged_gaps, bridged_gaps_said, with_bridged_gaps
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import LoopProgress, run_slam
from nscan_cli.slam.state import SlamState
from nscan_cli.slam.systematic_error import (
    systematic_error,
    systematic_error_said,
    without_systematic_error,
)


@dataclass(frozen=True)
class MappedDrive:
    """What `map_drive` returns."""

    state: SlamState
    graph: Graph
    messages: list[str]
    """What was put right."""
    reading: ReadingOptions
    """The options that read the log with the clock of its odometry as it is now."""


def map_drive(
    log: LaserLog,
    options: SlamOptions,
    threads: int = 1,
    progress: Callable[[SlamState], LoopProgress] = lambda _state: lambda *_counts: None,
    reading: ReadingOptions = ReadingOptions(),
    has_findings: bool = False,
) -> MappedDrive:
    """Run the loop, and again as long as its map shows that odometry is late or early, a wrong mounting or
    scale, a systematic error of odometry, or the way over gaps of it.

    `progress` makes what each run reports to. The log was read with `reading`; as recorded, its odometry is
    believed. If it `has_findings`, the check of the file has named already what scans contradict.
    """
    checks = options.file_check
    limits, total, least = options.systematic_error, None, options.systematic_error.min_length
    runs_left = 0 if reading.as_recorded else limits.max_runs
    gaps: list[BridgedGap] = []
    said: list[str] = []
    clock_runs_left = 0 if reading.as_recorded or reading.clock_offset else options.clock_runs
    is_asked = reading.as_recorded or has_findings
    while True:
        state = SlamState.of_log(log, options, threads)
        graph = run_slam(state, progress(state))
        path = log, graph.poses, state.breaks, reading
        if clock_runs_left and (clock := clock_by_map(*path, checks)) is not None:
            clock_runs_left -= 1
            log, reading, said = clock.log, clock.reading, said + clock.messages
            continue
        findings = [] if is_asked else contradictions_by_map(*path, checks)
        is_asked = True
        said += [finding.message for finding in findings]
        recorded, log = log, agreeing(log, findings)
        if log is not recorded:
            continue
        found = systematic_error(graph.poses, log.odometry, state.breaks, limits, least)
        if found is not None and runs_left:
            runs_left, least = runs_left - 1, limits.min_more_length
            log = without_systematic_error(log, found)
            total = found if total is None else total.and_then(found)
        elif gaps or reading.as_recorded or not (gaps := bridged_gaps(state, graph.poses)):
            break
        else:
            log = with_bridged_gaps(log, gaps)
    said += [] if total is None else [systematic_error_said(total, reading)]
    return MappedDrive(state, _as_told(graph, gaps), said + bridged_gaps_said(log, gaps), reading)


def _as_told(graph: Graph, gaps: list[BridgedGap]) -> Graph:
    """The graph without odometry in these gaps."""
    if graph.odometry is None or not gaps:
        return graph
    odometry = graph.odometry.copy()
    for gap in gaps:
        odometry[gap.first : gap.end] = np.nan
    return replace(graph, odometry=odometry)
