"""The task of a worker process: one log to map and measure; and the outcome it returns."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nscan_cli.logs.reading_options import ReadingOptions, as_tuples
from nscan_cli.nightly.manifest import ManifestEntry

OUTPUTS, TASK, RESULT = "outputs", "task.json", "result.json"
"""The names in a workspace beside the inputs: the folder of outputs, the task, and the result at the end."""


@dataclass(frozen=True)
class Task:
    """One log to map and measure."""

    name: str
    inputs: dict[str, str]
    """Role → absolute path."""
    reading: dict[str, Any]
    mapping: dict[str, Any]

    @classmethod
    def of(cls, entry: ManifestEntry) -> Task:
        """The task of a log of the manifest."""
        inputs = {role: str(path.absolute()) for role, path in entry.inputs.items()}
        reading = dataclasses.asdict(entry.parameters.reading)
        return cls(entry.name, inputs, reading, entry.parameters.mapping)

    def workspace_paths(self) -> dict[str, str]:
        """Role → path in a workspace. It is the same on every machine, and so are results and messages."""
        return {role: f"{role}/{Path(path).name}" for role, path in self.inputs.items()}

    def to_json(self, threads: int) -> str:
        """The task for a worker process that uses this number of threads."""
        told = {"inputs": self.workspace_paths(), "reading": self.reading, "mapping": self.mapping}
        return json.dumps({**told, "threads": threads})


def reading_options_from(record: dict[str, Any]) -> ReadingOptions:
    """The reading options of a task's JSON."""
    return ReadingOptions(**{name: as_tuples(value) for name, value in record.items()})


@dataclass(frozen=True)
class Outcome:
    """What a task has returned."""

    result: dict[str, Any]
    """`counts`, `evaluation` and `times`; or, if the log failed, its `reason`."""
    files: dict[str, bytes]
    """Name → content of the outputs; empty if the log failed."""

    @classmethod
    def failed(cls, reason: str) -> Outcome:
        """The outcome of a log that failed; the reason is joined to one line."""
        return cls({"reason": " ".join(reason.split())}, {})


ProgressCallback = Callable[[str, int, int, int], None]
"""Called with the name of a log, its scans done, all its scans, and its keyframes so far."""
