"""The log of a graph: finds it, checks that it is the right one, and reads it with the options of slam."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.files.limits import DISTANCE
from nscan_cli.files.provenance import is_made_from
from nscan_cli.files.text import counted, name_of_path, path_of_name
from nscan_cli.logs.log_files import JOURNAL_SUFFIXES
from nscan_cli.logs.reading_options import ReadingOptions, as_tuples
from nscan_cli.logs.recordings.split_file_names import ROS2_SUFFIXES, parse_name

if TYPE_CHECKING:
    from nscan_cli.files.provenance import Source
    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.poses import Indices

GRAPH_LOG_REMEDY = "give the log that the graph was made from"


def read_graph_log(
    graph_file: str, graph: Graph, paths: Sequence[str], reading: ReadingOptions
) -> tuple[LaserLog, Indices, Indices]:
    """Read the graph's log at `paths`.

    Returns the log, the nodes (N,) whose scans `reading` includes, and their rows (N,) in the log.
    Raises InputMissingError if it cannot be read, InputDataError if it is not the graph's log.
    """
    import numpy as np

    from nscan_cli.kernels.decorators import load_runtime
    from nscan_cli.logs.load import read_log
    from nscan_cli.logs.log_files import parts_of

    load_runtime()
    path = parts_of(paths).title
    log = read_log(paths, _options_of_slam(reading, graph_file, graph.provenance))
    inputs = _graph_inputs(graph)
    if inputs and not is_made_from(inputs, log.source):
        raise InputDataError(
            path, f"is not the log of {graph_file}: {_difference(inputs, log.source)}", GRAPH_LOG_REMEDY
        )
    rows = np.minimum(np.searchsorted(log.numbers, graph.scans), len(log) - 1)
    there = log.numbers[rows] == graph.scans
    some_left_out = reading.start is not None or reading.end is not None or reading.every > 1
    if not there.all() and not some_left_out:
        number = int(graph.scans[np.argmin(there)])
        raise InputDataError(path, f"has no scan {number}, which {graph_file} has", GRAPH_LOG_REMEDY)
    return dataclasses.replace(log, mapped_path=graph.path), np.flatnonzero(there), rows[there]


def find_log(graph_file: str, graph: Graph) -> tuple[str, ...]:
    """Find the graph's log: beside the graph, in the current folder, or in a folder in one of them.

    Raises InputMissingError if it is not found.
    """
    inputs = _graph_inputs(graph)
    if not inputs:
        raise InputMissingError(f"{graph_file}: does not name its log; give its path as LOG")
    # Journals of a database are found by the database's name.
    bases = [source["name"] for source in inputs]
    sizes = {
        Path(source["name"]).name: source["bytes"]
        for source in inputs
        if not any(source["name"] == base + end for base in bases for end in JOURNAL_SUFFIXES)
    }
    for folder in (Path(graph_file).parent, Path()):
        files = [_file_named(name, folder) for name in sizes]
        if None not in files:
            return tuple(map(str, files))
    for folder in (Path(graph_file).parent, Path()):
        for inner in _folders(folder):
            # Recordings of equal names lie in folders of their own.
            paths = {inner / path_of_name(name): size for name, size in sizes.items()}
            if all(path.is_file() and path.stat().st_size == size for path, size in paths.items()):
                return tuple(map(str, paths))
    more = f" and {counted(len(sizes) - 1, 'more file')}" if len(sizes) > 1 else ""
    first = next(iter(sizes))
    place = _folder_of_recorder(first)
    remedy = "give its path as LOG" if place is None else f"give it, or its folder such as {place}/, as LOG"
    raise InputMissingError(
        f"{graph_file}: its log {first}{more} is neither beside it nor in the current folder; {remedy}"
    )


def _folder_of_recorder(name: str) -> str | None:
    """The folder into which `ros2 bag record` writes a file of this name; None if it writes no such file."""
    part = parse_name(name)
    folder, suffix = part.recording
    return folder if part.number is not None and suffix in ROS2_SUFFIXES and folder else None


def _file_named(name: str, folder: Path) -> Path | None:
    """The file in the folder with this name in the graph, which may not be UTF-8; None if there is none."""
    path = folder / path_of_name(name)
    if path.is_file():
        return path
    if "\\" in name:
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            same = [Path(each.path) for each in entries if name_of_path(each.name) == name]
            return min(same, default=None)
    return None


def _folders(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.is_dir())
    except OSError:
        return []


def _graph_inputs(graph: Graph) -> list[dict[str, Any]]:
    inputs: list[dict[str, Any]] = graph.provenance.get("inputs") or []
    return inputs


def _difference(inputs: Sequence[dict[str, Any]], source: Source) -> str:
    """The difference between the files of a log and those of the graph, for a message."""
    if len(inputs) == 1 and not source.parts:
        return "its SHA-256 differs"
    there = {file.sha256 for file in source.files}
    missing = [file["name"] for file in inputs if file["sha256"] not in there]
    if missing:
        return f"{', '.join(missing)} is not among its files, or has another SHA-256"
    return f"the graph was made from {counted(len(inputs), 'file')} of its {len(source.files)}"


def _options_of_slam(reading: ReadingOptions, graph_file: str, provenance: dict[str, Any]) -> ReadingOptions:
    """`reading`, with the options that slam has read the graph's log with in place of defaults.

    Except start, end and every: the graph itself has its scans.
    Raises InputDataError if the graph has an option of the wrong type.
    """
    choices = {"start", "end", "every"}
    tracked = provenance.get("parameters", {}).get("reading", {})
    default = ReadingOptions()
    kept: dict[str, Any] = {}
    for option in dataclasses.fields(ReadingOptions):
        unsaid = getattr(reading, option.name) == getattr(default, option.name)
        if isinstance(tracked, dict) and unsaid and option.name in tracked and option.name not in choices:
            value = tracked[option.name]
            if not _is_value_of(value, str(option.type)):
                problem = f"provenance.parameters.reading: {option.name} is {str(value)[:40]!r}"
                raise InputDataError(graph_file, problem, "correct it, or create the graph again")
            kept[option.name] = as_tuples(value)
    return dataclasses.replace(reading, **kept)


def _is_value_of(value: Any, kind: str) -> bool:
    """Whether a value of the graph fits a field of ReadingOptions with this annotation."""
    if value is None:
        return "None" in kind
    if isinstance(value, list) and kind.startswith("tuple[tuple"):
        return all(_are_numbers(part, 2) or _are_numbers(part, 3) for part in value)
    if isinstance(value, list):
        return kind.startswith("tuple") and _are_numbers(value, 3)
    if isinstance(value, bool):
        return kind == "bool"
    if isinstance(value, str):
        return kind.startswith("str")
    return kind.startswith("float") and isinstance(value, (int, float)) and abs(value) <= DISTANCE.value


def _are_numbers(value: Any, count: int) -> bool:
    return isinstance(value, list) and len(value) == count and all(_is_value_of(x, "float") for x in value)
