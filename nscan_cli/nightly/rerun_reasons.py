"""Why a log is run again: what differs from the run before, in words."""

from __future__ import annotations

from typing import Any

from nscan_cli.nightly.run_history import RunRecord

INPUT_NAMES = {"log": "the log", "relations": "the relations file", "reference": "the reference"}


def rerun_reasons(
    runs: list[RunRecord], key: str, tool: str, made_from: dict[str, Any], force: bool
) -> list[str]:
    """Why a log with these runs (oldest first) is run again; empty for a new log."""
    if not runs:
        return []
    last = runs[-1]
    # The new run will replace one with the same key, so it is compared with the last that has another.
    before = next((run for run in reversed(runs) if run["key"] != key and run["key"]), None)
    found = [] if before is None else _differences(before, tool, made_from)
    if last["outcome"] != "done":
        found.append("the last run failed")
    elif last["key"] == key:
        found.append("--force" if force else "results were missing or changed")
    return found


def _differences(before: RunRecord, tool: str, made_from: dict[str, Any]) -> list[str]:
    found = []
    then = before.get("made_from")
    if then is not None:
        for role, name in INPUT_NAMES.items():
            old, new = then["inputs"].get(role), made_from["inputs"].get(role)
            if old is None and new is not None:
                found.append(f"{name} is new")
            elif new is None and old is not None:
                found.append(f"{name} was removed")
            elif old is not None and new is not None and old[1] != new[1]:
                found.append(f"{name} has changed")
            elif old is not None and new is not None and old[0] != new[0]:
                found.append(f"{name} was renamed from {old[0]} to {new[0]}")
        old, new = then["parameters"], made_from["parameters"]
        found += [
            _parameter_difference(parameter, old.get(parameter), new.get(parameter))
            for parameter in sorted({*old, *new})
            if old.get(parameter) != new.get(parameter)
        ]
    if before["tool"] != tool:
        versions = [name.rpartition("-")[0] for name in (before["tool"], tool)]
        more = "" if versions[0] == versions[1] else f" from version {versions[0]} to {versions[1]}"
        found.append(f"the code of nscan-cli has changed{more}")
    return found or ["the log, its reference or its parameters have changed"]


def _parameter_difference(parameter: str, old: Any, new: Any) -> str:
    if new is None:
        return f"the parameter {parameter} was removed"
    return f"the parameter {parameter} is {new}" + ("" if old is None else f" instead of {old}")
