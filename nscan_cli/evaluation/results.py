"""Trajectories from what the tool and others write: graph, TUM file or log, told apart by content."""

from __future__ import annotations

import io
from dataclasses import replace

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.graph.json_file import parse_graph
from nscan_cli.graph.tum import Trajectory, parse_tum
from nscan_cli.inputs import STANDARD_INPUT, label, read_bytes
from nscan_cli.limits import GRAPH, MB, ExceededError
from nscan_cli.logs.load import AS_FOUND, read_log, unpacked
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.scan import LaserLog


def load_trajectory(path: str, options: ReadingOptions = AS_FOUND) -> Trajectory:
    """The poses of all scans of a graph, of a TUM file, or the robot's poses in a (corrected) log.

    Raises InputMissingError, InputDataError, and WrongUsageError where the options do not fit a log.
    """
    loaded = _load(path, options)
    if isinstance(loaded, Trajectory):
        return loaded
    if loaded.odometry is None:
        raise InputDataError(
            path, "the log has no poses of the robot", "give a graph, a TUM file or another log"
        )
    return Trajectory.in_order(loaded.times, loaded.odometry, loaded.stamps)


def load_reference(path: str, options: ReadingOptions = AS_FOUND) -> Trajectory:
    """The poses of a TUM file or a graph, or the true poses (TRUEPOS) in a log; raises the same errors."""
    loaded = _load(path, options)
    if isinstance(loaded, Trajectory):
        return loaded
    if loaded.truth is None or loaded.truth_times is None:
        problem = "the log has no true poses (TRUEPOS)"
        raise InputDataError(path, problem, "give a TUM file or a log with TRUEPOS as the reference")
    stamps = [repr(time) for time in loaded.truth_times.tolist()]
    return Trajectory.in_order(loaded.truth_times, loaded.truth, stamps)


def _load(path: str, options: ReadingOptions) -> Trajectory | LaserLog:
    name = label(path)
    try:
        data = unpacked(read_bytes(path), name)
        if data.lstrip().startswith(b"{") or _begins_with_numbers(data):
            GRAPH.check(len(data) / MB, f"has {len(data) / MB:,.0f} MB")
    except ExceededError as error:
        raise InputDataError(name, str(error), error.remedy) from error
    if not data.strip():
        raise InputDataError(name, "is empty", "give a graph, a TUM file or a log")
    if data.lstrip().startswith(b"{"):
        graph = parse_graph(data, name)
        return Trajectory.in_order(graph.times, graph.poses, graph.stamps)
    if _begins_with_numbers(data):
        return parse_tum(data, name)
    if path == STANDARD_INPUT:
        raise WrongUsageError(
            "-: a log has to be given by its path here; standard input takes a graph or TUM"
        )
    return read_log(path, replace(options, allow_corrected=True))


def _begins_with_numbers(data: bytes) -> bool:
    """Whether the first line that is neither blank nor a comment consists of numbers alone."""
    for line in io.BytesIO(data):
        fields = line.split()
        if fields and not fields[0].startswith(b"#"):
            return all(_is_number(field) for field in fields)
    return False


def _is_number(text: bytes) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
