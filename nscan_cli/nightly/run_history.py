"""What the folder knows of a log: one line for every night that changed it, the last line the state."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from nscan_cli.files.outputs import write_atomically
from nscan_cli.files.text import json_bytes

HISTORY_FILE = "nights.jsonl"

RunRecord = dict[str, Any]
"""One line: `key` (the fingerprint), `tool`, `made_from` (inputs and parameters), `outcome` ("done", or
"failed" with `reason`), of what is done `counts`, `evaluation` and `outputs` (name → SHA-256), and `times`,
all that may differ from call to call: among them `anew`, why it was made anew."""


def read_runs(folder: Path) -> list[RunRecord]:
    """The nights of the log with this folder, oldest first; none where the file is missing or damaged."""
    try:
        text = (folder / HISTORY_FILE).read_bytes().decode()
        nights = [json.loads(line) for line in text.splitlines()]
    except (OSError, ValueError):
        return []
    keys = {"key", "tool", "outcome", "times"}
    return nights if all(isinstance(night, dict) and keys <= set(night) for night in nights) else []


def is_up_to_date(folder: Path, key: str) -> bool:
    """Whether the last night was made from the same, went well, and left outputs that are all there still."""
    last = read_runs(folder)[-1:]
    if not last or last[0]["key"] != key or last[0]["outcome"] != "done":
        return False
    outputs: dict[str, str] = last[0]["outputs"]
    return all(_sha256(folder / name) == sha256 for name, sha256 in outputs.items())


def append_run(folder: Path, night: RunRecord, files: dict[str, bytes]) -> None:
    """Write the outputs of a night, and when all are there the night itself.

    A night from the same things as the last one takes its place: whoever is cut off and goes on, or tries
    again, has the same history as the one who gets through at once. But a failure never takes the place of
    what went well. Raises OutputError.
    """
    for name, content in files.items():
        write_atomically(str(folder / name), content)
    nights = read_runs(folder)
    again = bool(nights) and nights[-1]["key"] == night["key"]
    if again and (night["outcome"] == "done" or nights[-1]["outcome"] == "failed"):
        nights.pop()
    outputs = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    lines = [*nights, {**night, "outputs": outputs} if outputs else night]
    text = "".join(json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n" for line in lines)
    write_atomically(str(folder / HISTORY_FILE), json_bytes(text))


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
