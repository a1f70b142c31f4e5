"""Results of this or of another mapper with their log: graphs, g2o files and TUM trajectories."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

from nscan_cli.cli.graph_log import find_log, read_graph_log
from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.files.inputs import label, read_bytes
from nscan_cli.files.limits import GRAPH
from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.graph.io.tum import Trajectory
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.poses import Indices


G2O = "g2o"
HEAD = 1_000_000
"""Bytes in which a g2o file has a vertex. JSON graphs have no such word."""


class ResultOverLog(NamedTuple):
    """A result as a graph, and the scans of its nodes."""

    graph: Graph
    log: LaserLog
    nodes: Indices
    """(N,) the nodes with a scan that is drawn."""
    rows: Indices
    """(N,) their rows in the log."""
    notice: str | None = None
    """What has been assumed."""


def load_result(path: str) -> Graph | Trajectory:
    """The graph (JSON or g2o) or the trajectory (TUM) in a file, told apart by its content.

    Raises InputMissingError and InputDataError.
    """
    from nscan_cli.graph.io.json_graph import parse_graph
    from nscan_cli.graph.io.load_graph import graph_from
    from nscan_cli.graph.io.pose_columns import is_pose_table
    from nscan_cli.graph.io.tum import parse_tum

    data = read_bytes(path, GRAPH)
    if not data.lstrip().startswith(b"{") and is_pose_table(data):
        return parse_tum(data, label(path))
    if b"VERTEX" not in data[:HEAD]:
        return parse_graph(data, label(path))
    # The provenance of a g2o file is the file itself, which is no log.
    return dataclasses.replace(graph_from(data, path), provenance={"inputs": [], "format": G2O})


def log_of(path: str, result: Graph | Trajectory, log: tuple[str, ...]) -> tuple[str, ...]:
    """The log that was given, or that of the graph, looked for. Raises InputMissingError."""
    from nscan_cli.graph.model import Graph

    if log:
        return log
    if isinstance(result, Graph):
        return find_log(path, result)
    raise InputMissingError(f"{path}: a trajectory does not name its log; give its path as LOG")


def number_by_order(
    path: str, result: Graph | Trajectory, other_path: str, other: Graph | Trajectory
) -> str | None:
    """Give the vertices of a g2o file that count from 0 the scans of the other graph's keyframes, in order.

    Returns a notice that says so; None for other results, and where the numbers can be those of scans. Raises
    InputDataError if there are not as many keyframes.
    """
    import numpy as np

    from nscan_cli.graph.model import Graph

    if not (isinstance(result, Graph) and isinstance(other, Graph)) or result.provenance.get("format") != G2O:
        return None
    count, keyframes = np.arange(len(result)), other.scans[other.keyframes]
    if not np.array_equal(result.scans, count) or len(count) >= len(other) or keyframes[-1] < len(count):
        return None
    if len(keyframes) != len(count):
        problem = (
            f"its vertices count from 0 to {len(count) - 1}: they are neither the scans of {other_path} "
            f"({len(other)}) nor its keyframes ({len(keyframes)})"
        )
        raise InputDataError(label(path), problem, "give the trajectory in TUM format")
    result.scans = keyframes
    result.provenance = {"inputs": []}
    return (
        f"{label(path)}: its vertices are taken as the keyframes of {other_path} ({len(keyframes)}), in order"
    )


def over_log(
    path: str, result: Graph | Trajectory, log: tuple[str, ...], reading: ReadingOptions
) -> ResultOverLog:
    """The result with its scans. Poses of a trajectory belong to the scans that are nearest in time.

    Raises InputDataError if it is not of this log.
    """
    from nscan_cli.graph.model import Graph

    if isinstance(result, Graph):
        if result.vertices is not None:
            problem = "its vertices are too large for numbers of scans"
            raise InputDataError(label(path), problem, "give the trajectory in TUM format")
        scans, nodes, rows = read_graph_log(path, result, log, reading)
        if result.provenance.get("format") != G2O:
            return ResultOverLog(result, scans, nodes, rows)
        if len(nodes) == len(result):
            # A g2o file has no times.
            result = dataclasses.replace(result, stamps=[scans.stamps[row] for row in rows.tolist()])
        notice = f"{label(path)}: its vertices are taken as numbers of scans of {scans.source.name}"
        return ResultOverLog(result, scans, nodes, rows, notice)
    import numpy as np

    from nscan_cli.evaluation.time_association import mutual_nearest, no_match
    from nscan_cli.files.provenance import provenance_of
    from nscan_cli.kernels.decorators import load_runtime
    from nscan_cli.logs.load import read_log

    load_runtime()
    scans = read_log(log, reading)
    poses, rows = mutual_nearest(result.times, scans.times)
    if len(rows) == 0:
        raise no_match(label(path), result.times, scans.source.name, scans.times)
    graph = Graph(
        scans=scans.numbers[rows],
        stamps=[scans.stamps[row] for row in rows.tolist()],
        poses=result.poses[poses],
        odometry=None,
        anchors=np.zeros(len(rows), dtype=np.int64),
        provenance=provenance_of([scans.source], {}),
    )
    return ResultOverLog(graph, scans, np.arange(len(rows)), rows)
