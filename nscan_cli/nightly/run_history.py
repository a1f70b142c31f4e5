"""The history of a log: one line of JSON for each run; the last line is the present state."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from nscan_cli.files.outputs import write_atomically
from nscan_cli.files.text import json_bytes

HISTORY_FILE = "nights.jsonl"

RunRecord = dict[str, Any]
"""One line of the history: `key` (the fingerprint), `tool`, `made_from` (inputs and parameters), `outcome`
("done", or "failed" with `reason`), of a run that is done also `counts`, `evaluation` and `outputs` (name →
SHA-256), and `times`: what differs between two runs on the same inputs, with the rerun reasons in `anew`."""


def read_runs(folder: Path) -> list[RunRecord]:
    """The runs of the log with this results folder, oldest first; none if the file is missing or damaged."""
    try:
        text = (folder / HISTORY_FILE).read_bytes().decode()
        runs = [json.loads(line) for line in text.splitlines()]
    except (OSError, ValueError):
        return []
    keys = {"key", "tool", "outcome", "times"}
    return runs if all(isinstance(run, dict) and keys <= set(run) for run in runs) else []


def is_up_to_date(folder: Path, key: str) -> bool:
    """Whether the last run has this fingerprint, did not fail, and its outputs are unchanged."""
    last = read_runs(folder)[-1:]
    if not last or last[0]["key"] != key or last[0]["outcome"] != "done":
        return False
    outputs: dict[str, str] = last[0]["outputs"]
    return all(_sha256(folder / name) == sha256 for name, sha256 in outputs.items())


def append_run(folder: Path, run: RunRecord, files: dict[str, bytes]) -> None:
    """Write the outputs of a run, then append the run to the history. Raises OutputError.

    A run with the fingerprint of the last one replaces it, so that a command that is interrupted and repeated
    leaves the same history as one that is not. A failed run never replaces one that is done.
    """
    for name, content in files.items():
        write_atomically(str(folder / name), content)
    runs = read_runs(folder)
    is_repeated = bool(runs) and runs[-1]["key"] == run["key"]
    if is_repeated and (run["outcome"] == "done" or runs[-1]["outcome"] == "failed"):
        runs.pop()
    outputs = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    lines = [*runs, {**run, "outputs": outputs} if outputs else run]
    text = "".join(json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n" for line in lines)
    write_atomically(str(folder / HISTORY_FILE), json_bytes(text))


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
