"""What a process is told to do for one log, and what comes back."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.nightly.manifest import ManifestEntry

OUTPUTS, TASK, RESULT = "outputs", "task.json", "result.json"
"""What a place of work has besides the inputs: a folder of outputs, the task, and at the end the result."""


@dataclass(frozen=True)
class Task:
    """One log to be mapped and measured."""

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

    def places(self) -> dict[str, str]:
        """Role → path in a place of work: the same everywhere, as results and messages are to be."""
        return {role: f"{role}/{Path(path).name}" for role, path in self.inputs.items()}

    def to_json(self, threads: int) -> str:
        """For the process that does it, in so many threads."""
        told = {"inputs": self.places(), "reading": self.reading, "mapping": self.mapping}
        return json.dumps({**told, "threads": threads})


def reading_options_from(record: dict[str, Any]) -> ReadingOptions:
    """The reading options of a task's JSON."""
    mount = record["mount"]
    return ReadingOptions(**{**record, "mount": None if mount is None else tuple(mount)})


@dataclass(frozen=True)
class Outcome:
    """What became of a log."""

    result: dict[str, Any]
    """`counts`, `evaluation` and `times` of what is done; of what failed, the `reason`."""
    files: dict[str, bytes]
    """Name → content of the outputs; none of what failed."""

    @classmethod
    def failed(cls, reason: str) -> Outcome:
        """The log failed, and nothing else did. The reason is one line."""
        return cls({"reason": " ".join(reason.split())}, {})


ProgressCallback = Callable[[str, int, int, int], None]
"""Called with the name of a log, and its scans done, all its scans, and its keyframes so far."""
