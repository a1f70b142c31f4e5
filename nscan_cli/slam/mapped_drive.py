"""A drive is mapped, and again where its map shows what is wrong with its odometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from nscan_cli.calibration.agreeing_odometry import agreeing
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array
from nscan_cli.slam.clock_by_map import clock_by_map
from nscan_cli.slam.contradictions_by_map import contradictions_by_map
from nscan_cli.slam.odometry_gaps import BridgedGap, bridged_gaps, bridged_gaps_said, with_bridged_gaps
from nscan_cli.slam.options import SlamOptions, SystematicErrorOptions
from nscan_cli.slam.pipeline import LoopProgress, run_slam
from nscan_cli.slam.state import SlamState
from nscan_cli.slam.systematic_error import (
    SystematicError,
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
    gaps = _Gaps()
    corrections: list[_Correction] = [
        _Clock(options, 0 if reading.clock_offset else options.clock_runs),
        _Contradictions(options, has_findings),
        _SystematicError(options.systematic_error),
        gaps,
    ]
    drive = _Drive(log, reading)
    while True:
        state = SlamState.of_log(drive.log, options, threads)
        graph = run_slam(state, progress(state))
        if reading.as_recorded:
            return MappedDrive(state, graph, [], reading)
        # The first that changes the drive: the others ask the map that comes of it.
        changed = (each.corrected(drive, state, graph.poses) for each in corrections)
        corrected = next((each for each in changed if each is not None), None)
        if corrected is None:
            break
        drive = corrected
    said = [message for each in corrections for message in each.said(drive)]
    return MappedDrive(state, _as_told(graph, gaps.bridged), said, drive.reading)


class _Drive(NamedTuple):
    """A log, and the options that read it as it is."""

    log: LaserLog
    reading: ReadingOptions


class _Correction(Protocol):
    """Something that a map may show to be wrong with the odometry of its drive."""

    def corrected(self, drive: _Drive, state: SlamState, poses: Array) -> _Drive | None:
        """The drive, whose map has its scans at poses (S, 3), without what is wrong; None if nothing is."""

    def said(self, drive: _Drive) -> list[str]:
        """What was found, as said of the drive in its last form."""


class _Clock:
    """Odometry that is late or early."""

    def __init__(self, options: SlamOptions, runs: int) -> None:
        self._options, self._runs_left, self._said = options.file_check, runs, list[str]()

    def corrected(self, drive: _Drive, state: SlamState, poses: Array) -> _Drive | None:
        clock = None
        if self._runs_left:
            clock = clock_by_map(drive.log, poses, state.breaks, drive.reading, self._options)
        if clock is None:
            return None
        self._runs_left -= 1
        self._said += clock.messages
        return _Drive(clock.log, clock.reading)

    def said(self, drive: _Drive) -> list[str]:
        return self._said


class _Contradictions:
    """A wrong mounting or scale, or turns that are wrong, unless they are named already."""

    def __init__(self, options: SlamOptions, is_named: bool) -> None:
        self._options, self._is_named, self._said = options.file_check, is_named, list[str]()

    def corrected(self, drive: _Drive, state: SlamState, poses: Array) -> _Drive | None:
        if self._is_named:
            return None
        self._is_named = True
        found = contradictions_by_map(drive.log, poses, state.breaks, drive.reading, self._options)
        self._said += [finding.message for finding in found]
        log = agreeing(drive.log, found)
        return None if log is drive.log else drive._replace(log=log)

    def said(self, drive: _Drive) -> list[str]:
        return self._said


class _SystematicError:
    """Ways by odometry that are too long or too short everywhere, or that bend."""

    def __init__(self, options: SystematicErrorOptions) -> None:
        self._options, self._runs_left, self._least = options, options.max_runs, options.min_length
        self._total: SystematicError | None = None

    def corrected(self, drive: _Drive, state: SlamState, poses: Array) -> _Drive | None:
        found = None
        if self._runs_left:
            found = systematic_error(poses, drive.log.odometry, state.breaks, self._options, self._least)
        if found is None:
            return None
        self._runs_left, self._least = self._runs_left - 1, self._options.min_more_length
        self._total = found if self._total is None else self._total.and_then(found)
        return drive._replace(log=without_systematic_error(drive.log, found))

    def said(self, drive: _Drive) -> list[str]:
        return [] if self._total is None else [systematic_error_said(self._total, drive.reading)]


class _Gaps:
    """The way over gaps of odometry."""

    def __init__(self) -> None:
        self.bridged: list[BridgedGap] = []

    def corrected(self, drive: _Drive, state: SlamState, poses: Array) -> _Drive | None:
        if self.bridged:
            return None
        self.bridged = bridged_gaps(state, poses)
        return drive._replace(log=with_bridged_gaps(drive.log, self.bridged)) if self.bridged else None

    def said(self, drive: _Drive) -> list[str]:
        return bridged_gaps_said(drive.log, self.bridged)


def _as_told(graph: Graph, gaps: list[BridgedGap]) -> Graph:
    """The graph without odometry in these gaps."""
    if graph.odometry is None or not gaps:
        return graph
    odometry = graph.odometry.copy()
    for gap in gaps:
        odometry[gap.first : gap.end] = np.nan
    return replace(graph, odometry=odometry)
