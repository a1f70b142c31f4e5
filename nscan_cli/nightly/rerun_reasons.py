"""Why a log is made anew: what differs from the night before, in words."""

from __future__ import annotations

from typing import Any

from nscan_cli.nightly.run_history import RunRecord

INPUT_NAMES = {"log": "the log", "relations": "the file of relations", "reference": "the reference"}


def rerun_reasons(
    nights: list[RunRecord], key: str, tool: str, made_from: dict[str, Any], force: bool
) -> list[str]:
    """Why a log with these nights (oldest first) is done again; none for one that is new."""
    if not nights:
        return []
    last = nights[-1]
    # A night from the same things takes the place of the last one: what counts is what came before.
    before = next((night for night in reversed(nights) if night["key"] != key and night["key"]), None)
    found = [] if before is None else _differences(before, tool, made_from)
    if last["outcome"] != "done":
        found.append("it failed the night before")
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
                found.append(f"{name} is gone")
            elif old is not None and new is not None and old[1] != new[1]:
                found.append(f"{name} has changed")
            elif old is not None and new is not None and old[0] != new[0]:
                found.append(f"{name} is called {new[0]}, no longer {old[0]}")
        old, new = then["parameters"], made_from["parameters"]
        found += [
            _parameter_difference(parameter, old.get(parameter), new.get(parameter))
            for parameter in sorted({*old, *new})
            if old.get(parameter) != new.get(parameter)
        ]
    if before["tool"] != tool:
        versions = [name.rpartition("-")[0] for name in (before["tool"], tool)]
        more = "" if versions[0] == versions[1] else f": {versions[1]}, no longer {versions[0]}"
        found.append(f"the code of nscan-cli has changed{more}")
    return found or ["the log, what it is measured against, or its parameters have changed"]


def _parameter_difference(parameter: str, old: Any, new: Any) -> str:
    if new is None:
        return f"the parameter {parameter} is not given any more"
    return f"the parameter {parameter} is {new}" + ("" if old is None else f", no longer {old}")
