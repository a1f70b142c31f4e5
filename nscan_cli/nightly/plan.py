"""Which logs of a manifest are up to date, and which have to be run (again)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from nscan_cli.errors import NscanError
from nscan_cli.files.text import printable
from nscan_cli.nightly.fingerprint import fingerprint, input_hash, inputs_and_parameters, log_size, tool_key
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.rerun_reasons import rerun_reasons
from nscan_cli.nightly.run_history import is_up_to_date, read_runs


@dataclass(frozen=True)
class Plan:
    """The logs of a manifest, sorted by what a nightly run does with them."""

    absent: list[ManifestEntry] = field(default_factory=list)
    """Optional logs that are missing."""
    up_to_date: list[ManifestEntry] = field(default_factory=list)
    to_do: list[tuple[ManifestEntry, str]] = field(default_factory=list)
    """Logs to run with their fingerprints, the largest first: none is left to run alone at the end."""
    unreadable: list[tuple[ManifestEntry, str]] = field(default_factory=list)
    """Logs with an input that cannot be read, and the reason."""
    notes: dict[str, list[str]] = field(default_factory=dict)
    """Name of a log → warnings about its inputs."""
    made_from: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Name of a log → its inputs and parameters."""
    rerun_reasons: dict[str, list[str]] = field(default_factory=dict)
    """Name of a log → why it runs again; empty for a new one."""


def make_plan(entries: list[ManifestEntry], folder: Path, force: bool) -> Plan:
    """Sort the logs; with `force` those that are up to date run as well."""
    planned = Plan()
    for each in entries:
        if not each.is_there and each.optional:
            planned.absent.append(each)
            continue
        if not each.is_there:
            reason = f"{each.inputs['log'].name} is missing"
            planned.unreadable.append((each, _with_sources(each, reason)))
            continue
        entry, lacking = _with_what_is_there(each) if each.optional else (each, [])
        try:
            hashes = {role: input_hash(path, role) for role, path in entry.inputs.items()}
        except NscanError as error:
            planned.unreadable.append((entry, _with_sources(entry, str(error))))
            continue
        planned.notes[entry.name] = [
            f"{printable(entry.inputs[role].name)} differs from the file named in the manifest: "
            "its SHA-256 does not match"
            for role, sha256 in entry.sha256.items()
            if role in hashes and hashes[role] != sha256
        ] + lacking
        key = fingerprint(entry, hashes)
        planned.made_from[entry.name] = inputs_and_parameters(entry, hashes)
        if not force and is_up_to_date(folder / entry.name, key):
            planned.up_to_date.append(entry)
        else:
            planned.to_do.append((entry, key))
            runs, made_from = read_runs(folder / entry.name), planned.made_from[entry.name]
            planned.rerun_reasons[entry.name] = rerun_reasons(runs, key, tool_key(), made_from, force)
    planned.to_do.sort(key=lambda item: -log_size(item[0].inputs["log"]))
    return planned


def _with_what_is_there(entry: ManifestEntry) -> tuple[ManifestEntry, list[str]]:
    """An optional log without its missing references, and a note on each of them."""
    inputs = {role: path for role, path in entry.inputs.items() if path.exists()}
    lacking = [path for role, path in entry.inputs.items() if role not in inputs]
    notes = [f"{path.name} is missing, so no errors are measured" for path in lacking]
    return replace(entry, inputs=inputs), [_with_sources(entry, note) for note in notes]


def _with_sources(entry: ManifestEntry, error: str) -> str:
    missing = [role for role, path in entry.inputs.items() if not path.exists()]
    known = [entry.sources[role] for role in missing if role in entry.sources]
    return f"{error}; download from {' and '.join(known)}" if known else error
