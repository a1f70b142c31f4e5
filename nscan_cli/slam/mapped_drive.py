"""A drive is mapped, and again where its map shows what is wrong with its odometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.clock_by_map import clock_by_map
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
) -> MappedDrive:
    """Run the loop, and again as long as its map shows that odometry is late or early, or a systematic error
    of it, or the way over gaps of it.

    `progress` makes what each run reports to. The log was read with `reading`; as recorded, its odometry is
    believed.
    """
    limits, total, least = options.systematic_error, None, options.systematic_error.min_length
    runs_left = 0 if reading.as_recorded else limits.max_runs
    gaps: list[BridgedGap] = []
    said: list[str] = []
    clock_runs_left = 0 if reading.as_recorded or reading.clock_offset else options.clock_runs
    while True:
        state = SlamState.of_log(log, options, threads)
        graph = run_slam(state, progress(state))
        clock = clock_by_map(log, graph.poses, state.breaks, reading, options.file_check)
        if clock is not None and clock_runs_left:
            clock_runs_left -= 1
            log, reading, said = clock.log, clock.reading, said + clock.messages
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
