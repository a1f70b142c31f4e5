"""A night: what is out of date is done again, and its results go to the folder, log by log."""

from __future__ import annotations

import contextlib
import datetime
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from nscan_cli.errors import NscanError
from nscan_cli.files.text import shown
from nscan_cli.nightly.fingerprint import fingerprint, input_hash, made_from, size_of, tool_key
from nscan_cli.nightly.folder import folder_of, scratch
from nscan_cli.nightly.manifest import Entry
from nscan_cli.nightly.night_history import Night, add_night, is_up_to_date, read_nights
from nscan_cli.nightly.rebuild_reasons import reasons
from nscan_cli.nightly.task import Outcome, Report, Task


@dataclass(frozen=True)
class Plan:
    """What a night has to do."""

    absent: list[Entry] = field(default_factory=list)
    up_to_date: list[Entry] = field(default_factory=list)
    to_do: list[tuple[Entry, str]] = field(default_factory=list)
    """With their fingerprints; the largest first, so that none is left to run alone at the end."""
    unreadable: list[tuple[Entry, str]] = field(default_factory=list)
    """With the reason."""
    notes: dict[str, list[str]] = field(default_factory=dict)
    """Name → what is odd about its inputs."""
    made_from: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Name → inputs and parameters."""
    anew: dict[str, list[str]] = field(default_factory=dict)
    """Name → why it is to be done although it was done before."""


Outcomes = Generator[tuple[Task, Outcome]]
"""Every task with its outcome, as they get done; closed, it stops what is running."""
Engine = Callable[[list[Task], Path, Report], Outcomes]
"""What does the tasks, with a folder for what is only needed meanwhile: see `processes` and `cluster`."""


class Watcher(Protocol):
    """Is told what goes on."""

    def progress(self, name: str, done: int, total: int, keyframes: int) -> None:
        """Scans done, all scans, and keyframes so far."""

    def finished(self, entry: Entry, night: Night) -> None:
        """A log is done, or failed."""


def plan(entries: list[Entry], folder: Path, force: bool) -> Plan:
    """What has to be done; with `force` all that is there."""
    planned = Plan()
    for each in entries:
        if not each.is_there and each.optional:
            planned.absent.append(each)
            continue
        if not each.is_there:
            reason = f"{each.inputs['log'].name} is not there"
            planned.unreadable.append((each, _with_sources(each, reason)))
            continue
        entry, lacking = _with_what_is_there(each) if each.optional else (each, [])
        try:
            hashes = {role: input_hash(path, role) for role, path in entry.inputs.items()}
        except NscanError as error:
            planned.unreadable.append((entry, _with_sources(entry, str(error))))
            continue
        planned.notes[entry.name] = [
            f"{shown(entry.inputs[role].name)} is not the file that the manifest means: "
            "its SHA-256 is another"
            for role, sha256 in entry.sha256.items()
            if role in hashes and hashes[role] != sha256
        ] + lacking
        key = fingerprint(entry, hashes)
        planned.made_from[entry.name] = made_from(entry, hashes)
        if not force and is_up_to_date(folder / entry.name, key):
            planned.up_to_date.append(entry)
        else:
            planned.to_do.append((entry, key))
            nights, this = read_nights(folder / entry.name), planned.made_from[entry.name]
            planned.anew[entry.name] = reasons(nights, key, tool_key(), this, force)
    planned.to_do.sort(key=lambda item: -size_of(item[0].inputs["log"]))
    return planned


def _with_what_is_there(entry: Entry) -> tuple[Entry, list[str]]:
    """An optional log without what is not there to measure it against, and what is to be said of that."""
    inputs = {role: path for role, path in entry.inputs.items() if path.exists()}
    lacking = [path for role, path in entry.inputs.items() if role not in inputs]
    notes = [f"{path.name} is not there: there is nothing to measure it against" for path in lacking]
    return replace(entry, inputs=inputs), [_with_sources(entry, note) for note in notes]


def _with_sources(entry: Entry, error: str) -> str:
    """The error, and where what is not there can be got."""
    missing = [role for role, path in entry.inputs.items() if not path.exists()]
    known = [entry.sources[role] for role in missing if role in entry.sources]
    return f"{error}; to be had from {' and '.join(known)}" if known else error


def carry_out(planned: Plan, folder: Path, engine: Engine, watcher: Watcher) -> None:
    """Do what is planned. Each log's results are in the folder as soon as it is done.

    Raises OutputError, and what the engine raises.
    """
    for entry, reason in planned.unreadable:
        # What cannot be read has no hash: never the same as anything.
        _finish(entry, "", Outcome.failed(reason), planned, folder, watcher)
    entries = {entry.name: (entry, key) for entry, key in planned.to_do}
    if not entries:
        return
    with scratch(folder) as place:
        tasks = [Task.of(entry) for entry, _key in planned.to_do]
        outcomes = engine(tasks, place, watcher.progress)
        with contextlib.closing(outcomes):
            for task, outcome in outcomes:
                _finish(*entries[task.name], outcome, planned, folder, watcher)


def _finish(entry: Entry, key: str, outcome: Outcome, planned: Plan, folder: Path, watcher: Watcher) -> None:
    now = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
    night: Night = {
        "key": key,
        "tool": tool_key(),
        "outcome": "failed" if "reason" in outcome.result else "done",
        "made_from": planned.made_from.get(entry.name),
        **{name: value for name, value in outcome.result.items() if name != "times"},
        "times": {
            **outcome.result.get("times", {}),
            "finished": now.isoformat().replace("+00:00", "Z"),
            "anew": planned.anew.get(entry.name, []),
        },
    }
    add_night(folder_of(folder, entry.name), night, outcome.files)
    watcher.finished(entry, night)
