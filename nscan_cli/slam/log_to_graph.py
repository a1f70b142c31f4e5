"""A log is mapped: the whole loop (paper, V), and a graph that says what it was made from."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.files.provenance import as_parameters, provenance_of
from nscan_cli.graph.model import Graph
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.scan_checks import SCAN_CHECKS
from nscan_cli.slam.backend.guessed_steps import guessed_steps
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.local_matching.options import NScanOptions
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import Relations, SlamOptions
from nscan_cli.slam.pipeline import LoopProgress
from nscan_cli.slam.state import SlamState

MappingProgress = Callable[[int, int, int], None]
"""Called with the scans done, the keyframes, and the loops that are accepted so far."""


@dataclass(frozen=True)
class GraphCounts:
    """What a graph is made of."""

    keyframes: int
    pairwise: int
    nscan: int
    accepted: int
    """Loops that were accepted."""
    refused: Counter[str]
    """Reason → loops that were refused for it."""

    @classmethod
    def of(cls, graph: Graph) -> GraphCounts:
        """The counts of a graph."""
        refused = Counter(loop.reason for loop in graph.loops if not loop.accepted)
        accepted = len(graph.loops) - refused.total()
        return cls(len(graph.keyframes), len(graph.pairwise), len(graph.nscan), accepted, refused)


def slam_options(
    max_scans: int | None = None, relations: Relations | None = None, loops: bool = True
) -> SlamOptions:
    """The options with what a user may set; None means the default."""
    nscan, whole = NScanOptions(loops=loops), SlamOptions()
    if max_scans is not None:
        nscan = dataclasses.replace(nscan, max_scans=max_scans)
    return dataclasses.replace(whole, nscan=nscan, relations=relations or whole.relations)


def notices_of_mapping(log: LaserLog, graph: Graph) -> list[str]:
    """The notices of mapping. The graph's notices begin with those of reading the log."""
    found: list[str] = graph.provenance["notices"]
    return found[len(log.report.notices()) :]


def map_log(
    log: LaserLog, reading: ReadingOptions, options: SlamOptions, threads: int, report: MappingProgress
) -> tuple[SlamState, Graph]:
    """The state at the end of the loop, and the graph of a log that was read with `reading`.

    What the scans contradict of their file beyond doubt is put right first.
    """
    checked = checked_file(log, reading, options.file_check)

    def progress(state: SlamState) -> LoopProgress:
        looked_at = accepted = 0

        def tell(done: int, keyframes: int) -> None:
            # Another thread may make the list longer meanwhile; only in the end is it looked through again.
            nonlocal looked_at, accepted
            new = state.loops[looked_at:]
            looked_at += len(new)
            accepted += sum(loop.accepted for loop in new)
            report(done, keyframes, accepted)

        return tell

    drive = map_drive(checked.log, options, threads, progress, checked.reading, checked.has_findings)
    parameters: dict[str, Any] = {
        "reading": dataclasses.asdict(drive.reading),
        "scan_checks": as_parameters(SCAN_CHECKS),
        "slam": as_parameters(options),
    }
    state, graph, said = drive.state, drive.graph, log.report.notices() + checked.messages + drive.messages
    said += notices(state, checked.companions_checked)
    graph.provenance = {**provenance_of([log.source], parameters), "notices": said, **guessed_steps(state)}
    return state, graph
