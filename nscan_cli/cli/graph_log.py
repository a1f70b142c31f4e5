"""The log of a graph: found through it, checked to be the one, and read as slam has read it."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.limits import DISTANCE
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.text import name_of_path, path_of_name

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from nscan_cli.graph.model import Graph
    from nscan_cli.logs.scan import LaserLog

REMEDY = "give the log that the graph was made from"


def read_graph_log(
    graph_file: str, graph: Graph, path: str, reading: ReadingOptions
) -> tuple[LaserLog, NDArray[np.int64], NDArray[np.int64]]:
    """The graph's log at `path`; the nodes (N,) whose scans `reading` leaves in, and the rows (N,) of these.

    Raises InputMissingError when it cannot be read, InputDataError when it is another log than the graph's.
    """
    import numpy as np

    from nscan_cli.compiled import bring_up
    from nscan_cli.logs.load import read_log

    bring_up()
    log = read_log(path, _as_tracked(reading, graph_file, graph.provenance))
    sha256 = _source(graph).get("sha256")
    if sha256 is not None and sha256 != log.source.sha256:
        raise InputDataError(path, f"is not the log of {graph_file}: its SHA-256 is another", REMEDY)
    rows = np.minimum(np.searchsorted(log.numbers, graph.scans), len(log) - 1)
    there = log.numbers[rows] == graph.scans
    some_left_out = reading.start is not None or reading.end is not None or reading.every > 1
    if not there.all() and not some_left_out:
        number = int(graph.scans[np.argmin(there)])
        raise InputDataError(path, f"has no scan {number}, which {graph_file} has", REMEDY)
    return log, np.flatnonzero(there), rows[there]


def find_log(graph_file: str, graph: Graph) -> str:
    """The path of the graph's log, beside the graph or in the current folder. Raises InputMissingError."""
    name = _source(graph).get("name")
    if name is None:
        raise InputMissingError(f"{graph_file}: does not name its log; give its path as LOG")
    for folder in (Path(graph_file).parent, Path()):
        path = folder / path_of_name(Path(name).name)
        if path.is_file():
            return str(path)
        if "\\" in name and (same := _shown_as(name, folder)):
            return same
    raise InputMissingError(
        f"{graph_file}: its log {name} is neither beside it nor in the current folder; give its path as LOG"
    )


def _shown_as(name: str, folder: Path) -> str | None:
    """The file in the folder that the graph calls so, since its name is no UTF-8."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        return min((each.path for each in entries if name_of_path(each.name) == name), default=None)
    return None


def _source(graph: Graph) -> dict[str, Any]:
    """What the graph says of the log that it was made from."""
    sources: list[dict[str, Any]] = graph.provenance.get("inputs") or [{}]
    return sources[0]


def _as_tracked(reading: ReadingOptions, graph_file: str, provenance: dict[str, Any]) -> ReadingOptions:
    """The options that the graph's log was read with, where `reading` does not say otherwise.

    But which scans there are, the graph itself says; `reading` may leave out more.
    Raises InputDataError where the graph has options that the log cannot have been read with.
    """
    choices = {"start", "end", "every"}
    tracked = provenance.get("parameters", {}).get("reading", {})
    default = ReadingOptions()
    kept: dict[str, Any] = {}
    for option in dataclasses.fields(ReadingOptions):
        unsaid = getattr(reading, option.name) == getattr(default, option.name)
        if isinstance(tracked, dict) and unsaid and option.name in tracked and option.name not in choices:
            value = tracked[option.name]
            if not _fits(value, str(option.type)):
                problem = f"provenance.parameters.reading: {option.name} is {str(value)[:40]!r}"
                raise InputDataError(graph_file, problem, "mend it, or write the graph again")
            kept[option.name] = tuple(value) if isinstance(value, list) else value
    return dataclasses.replace(reading, **kept)


def _fits(value: Any, kind: str) -> bool:
    """Whether a value of the graph is one for a field of ReadingOptions with this annotation."""
    if value is None:
        return "None" in kind
    if isinstance(value, list):
        return kind.startswith("tuple") and len(value) == 3 and all(_fits(part, "float") for part in value)
    if isinstance(value, bool) or kind == "bool":
        return isinstance(value, bool) and kind == "bool"
    if isinstance(value, str):
        return kind.startswith("str")
    return kind.startswith("float") and isinstance(value, (int, float)) and abs(value) <= DISTANCE.value
