"""The path of a graph in its JSON: lists of a time and the pose of the robot then."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.files.limits import DISTANCE, TIME
from nscan_cli.graph.io.json_fields import JsonRecord, MalformedError, bounded_numbers, pose_rows

if TYPE_CHECKING:
    from nscan_cli.logs.robot_path import RobotPath


def path_records(path: RobotPath) -> Iterator[str]:
    """Each pose of a path in JSON. Times have all their digits, so that reading gives the same."""
    for time, (x, y, angle) in zip(path.times.tolist(), pose_rows(path.poses), strict=True):
        yield f"[{time!r},{x!r},{y!r},{angle!r}]"


def path_of_records(document: JsonRecord) -> RobotPath | None:
    """The path of a document; None if it has none. Raises MalformedError."""
    if "path" not in document:
        return None
    from nscan_cli.logs.robot_path import robot_path

    values = document.get("path")
    if not isinstance(values, list) or len(values) < 2:
        raise document.wrong("path", "a list of at least two lists of a time and a pose")
    rows = np.empty((len(values), 4))
    expected = (
        f"is not a time up to {TIME.text()} and a pose of three finite numbers up to {DISTANCE.value:g}"
    )
    for number, value in enumerate(values):
        error = MalformedError(f"path[{number}]", expected)
        rows[number] = bounded_numbers(value, 4, error, TIME)
        if (np.abs(rows[number, 1:]) > DISTANCE.value).any():
            raise error
    late = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0) + 1
    if len(late):
        raise MalformedError(f"path[{late[0]}]", "is not later than the one before")
    return robot_path(rows[:, 0], rows[:, 1:])
