"""Trajectories from graphs, TUM files, logs and recordings, told apart by their content."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.inputs import FileBytes, label, limits_as_input_errors, read_bytes
from nscan_cli.files.limits import GRAPH, MB
from nscan_cli.graph.io.json_graph import parse_graph
from nscan_cli.graph.io.pose_columns import is_pose_table
from nscan_cli.graph.io.tum import Trajectory, parse_tum
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import content_of, log_from, read_log, read_recording, recording_from, stored_bytes
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.pose_topics import poses_on_topic
from nscan_cli.poses import are_known


def load_trajectory(
    path: str, options: ReadingOptions = ReadingOptions(), notices: list[str] | None = None
) -> Trajectory:
    """The poses of all scans of a graph, of a TUM file, or the robot's poses in a (corrected) log.

    Warnings are added to the `notices`. Raises InputMissingError,
    InputDataError, and WrongUsageError where the options do not fit a log.
    """
    notices = [] if notices is None else notices
    if os.path.isdir(path):
        log = read_log(path, replace(options, allow_corrected=True), even_unusable=True)
        notices += [f"{label(path)}: {notice}" for notice in log.report.notices()]
        loaded: Trajectory | LaserLog = log
    else:
        loaded = _trajectory_or_log(read_bytes(path), path, options, notices)
    if isinstance(loaded, Trajectory):
        return loaded
    if loaded.odometry is None:
        raise InputDataError(
            label(path), "the log has no poses of the robot", "give a graph, a TUM file or another log"
        )
    known = np.flatnonzero(are_known(loaded.odometry))
    stamps = [loaded.stamps[row] for row in known.tolist()]
    return Trajectory.in_order(loaded.times[known], loaded.odometry[known], stamps)


def load_reference(
    path: str,
    options: ReadingOptions = ReadingOptions(),
    notices: list[str] | None = None,
    topic: str | None = None,
) -> Trajectory:
    """The poses of a table (TUM, EuRoC) or a graph, the true poses (TRUEPOS) in a log, or those on a topic.

    A recording needs the topic, and nothing else may have one. Raises as load_trajectory does.
    """
    name, notices = label(path), [] if notices is None else notices
    stored: FileBytes = b""
    if os.path.isdir(path):
        recording = read_recording(path, options.salvage)
    else:
        stored = stored_bytes(path)
        recording = recording_from(stored, path, options.salvage)
    if recording is not None:
        notices += [f"{name}: {warning}" for warning in recording.warnings]
        return Trajectory.in_space(*poses_on_topic(recording, topic, name, notices))
    if topic is not None:
        raise WrongUsageError(f"{name}: is not a recording and has no topics; leave out --reference-topic")
    loaded = _trajectory_or_log(bytes(stored), path, options, notices)
    if isinstance(loaded, Trajectory):
        return loaded
    if loaded.truth is None or loaded.truth_times is None:
        problem = "the log has no true poses (TRUEPOS)"
        raise InputDataError(name, problem, "give a TUM file or a log with TRUEPOS as the reference")
    stamps = [repr(time) for time in loaded.truth_times.tolist()]
    return Trajectory.in_order(loaded.truth_times, loaded.truth, stamps)


def _trajectory_or_log(
    stored: bytes, path: str, options: ReadingOptions, notices: list[str]
) -> Trajectory | LaserLog:
    """The trajectory or the log in the bytes that `path` has."""
    name = label(path)
    data, lost = content_of(stored, path, options.salvage)
    assert isinstance(data, bytes)
    if not data.strip():
        raise InputDataError(name, "is empty", "give a graph, a TUM file or a log")
    is_graph = data.lstrip().startswith(b"{")
    if not is_graph and not is_pose_table(data):
        del data
        log = log_from(stored, path, replace(options, allow_corrected=True), even_unusable=True)
        # Corrected poses are expected here; only losses and skipped records are reported.
        told = log.report.notices()[0 if options.salvage else len(log.report.warnings) :]
        notices += [f"{name}: {notice}" for notice in told]
        return log
    with limits_as_input_errors(name):
        GRAPH.check(len(data) / MB, f"has {len(data) / MB:,.0f} MB")
    if lost:
        notices += [f"{name}: {warning}" for warning in lost]
        # The last line may be cut off within a number.
        data = data[: data.rfind(b"\n") + 1]
    if is_graph:
        graph = parse_graph(data, name)
        return Trajectory.in_order(graph.times, graph.poses, graph.stamps)
    return parse_tum(data, name)
