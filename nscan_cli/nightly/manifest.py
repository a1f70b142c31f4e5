"""The manifest: which logs to run, what to compare them with, and which errors are acceptable."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import urlsplit

from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.files.inputs import read_toml
from nscan_cli.files.text import path_of_name
from nscan_cli.nightly.manifest_parameters import LogParameters, parameters_from

LOG_SUFFIXES = (".log.gz", ".log", ".clf.gz", ".clf", ".script.gz", ".script", ".mcap", ".bag", ".db3", "")
"""Endings tried in this order for a log that the manifest gives by name alone. "" is a folder."""
LOG_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
RESERVED_NAMES = ("report.html", "report.json")
"""Names of files in the results folder, which no log can have."""
SHA256 = re.compile(r"[0-9a-f]{64}")
ROLES = ("log", "relations", "reference")
COPIED_KEYS = ("max_translation", "max_rotation", "optional", "about", "published_map")


@dataclass(frozen=True)
class ManifestEntry:
    """A log of the manifest."""

    name: str
    """Name of the log and of the folder of its results."""
    inputs: dict[str, Path]
    """Role → path; the roles are log, and relations or reference if given."""
    max_translation: float | None = None
    """Bound of the translational error (mean on relations, or RMSE against a reference), m."""
    max_rotation: float | None = None
    """Bound of the rotational error, degrees."""
    published: dict[str, float] = field(default_factory=dict)
    """Method → its published translational error, m."""
    parameters: LogParameters = field(default_factory=LogParameters)
    sources: dict[str, str] = field(default_factory=dict)
    """Role → address to download the file from."""
    sha256: dict[str, str] = field(default_factory=dict)
    """Role → SHA-256 of the file for which the bounds were measured."""
    optional: bool = False
    """Whether a missing log or reference is skipped; otherwise it is a failure."""
    names: tuple[str, ...] = ()
    """Names of the log's file without its ending; empty if the manifest has its path."""
    about: str = ""
    """A description for the report."""
    published_map: str = ""
    """Address of a published map."""

    @property
    def is_there(self) -> bool:
        """Whether the log exists."""
        return self.inputs["log"].exists()


def read_manifest(path: str, data: str | None) -> list[ManifestEntry]:
    """The logs of the manifest at `path`, or of the manifest of that name in the package.

    Paths are relative to the folder `data`, or to the manifest if that is None. Raises InputMissingError if
    it cannot be read, and InputDataError if its content is wrong.
    """
    file, folder = path, Path(path).parent
    if path in bundled_manifests() and not Path(path).exists():
        file = str(bundled_manifests()[path])
        if data is None:
            raise WrongUsageError(
                f"nightly: {path} has no logs of its own; give their folder with --data FOLDER; an empty one "
                "lists where to get them"
            )
    if data is not None:
        folder = Path(data)
        # Of the logs that come with the package it is said where to get them, as for an empty folder.
        if not folder.is_dir() and (folder.exists() or file == path):
            raise InputMissingError(f"--data {data}: is not a folder; give the folder of the logs")
    document = read_toml(file, "mend it")
    unknown = [key for key in document if key != "log"]
    if unknown:
        raise InputDataError(path, f"has an unknown key {unknown[0]!r}", "a manifest has [[log]] tables only")
    tables = document.get("log")
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables) or not tables:
        raise InputDataError(path, "has no logs", "add a [[log]] table with a name and a path for each")
    entries: list[ManifestEntry] = []
    for number, table in enumerate(tables, 1):
        entry = _manifest_entry(path, number, table, folder)
        # On some file systems, names that differ in case only are the same folder.
        if entry.name.lower() in (other.name.lower() for other in entries):
            raise InputDataError(path, f"two logs have the name {entry.name}", "rename one")
        entries.append(entry)
    return entries


def bundled_manifests() -> dict[str, Path]:
    """The manifests that come with the package, by name."""
    return {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}


def _manifest_entry(file: str, number: int, table: dict[str, Any], folder: Path) -> ManifestEntry:
    place = f"{file}, log {number}"
    name: Any = table.get("name")
    if not _is_name(name) or name.lower() in RESERVED_NAMES:
        remedy = "use letters, digits, '.', '_' and '-', as in intel"
        raise InputDataError(place, "has no name" if name is None else f"{name!r} is not a name", remedy)
    place += f" ({name})"
    for key, value in table.items():
        if key not in KEY_CHECKS:
            raise InputDataError(place, f"has an unknown key {key!r}", f"known: {', '.join(KEY_CHECKS)}")
        is_valid, wanted = KEY_CHECKS[key]
        if not is_valid(value):
            raise InputDataError(place, f"{key} is {_abbreviated(value)}", f"give {wanted}")
    if "relations" in table and "reference" in table:
        raise InputDataError(place, "has relations and reference", "remove one of them")
    for role in ROLES:
        for key in _origin_keys(role):
            if key in table and role != "log" and role not in table:
                raise InputDataError(place, f"has {key}, but no {role}", f"add {role}, or remove {key}")
    bounds = [key for key in ("max_translation", "max_rotation", "published") if key in table]
    if bounds and "relations" not in table and "reference" not in table:
        remedy = "add one of them"
        raise InputDataError(place, f"has {bounds[0]}, but neither relations nor reference", remedy)
    inputs = {
        "log": folder / path_of_name(table["path"]) if "path" in table else _find_log(folder, name, table)
    }
    inputs.update({role: _find_reference(folder, name, table, role) for role in ROLES[1:] if role in table})
    return ManifestEntry(
        name=name,
        inputs=inputs,
        names=() if "path" in table else tuple(_file_stems(name, table)),
        published={method: float(error) for method, error in table.get("published", {}).items()},
        parameters=parameters_from(place, table.get("parameters", {})),
        sources={role: table[_origin_keys(role)[0]] for role in ROLES if _origin_keys(role)[0] in table},
        sha256={role: table[_origin_keys(role)[1]] for role in ROLES if _origin_keys(role)[1] in table},
        **{key: table[key] for key in COPIED_KEYS if key in table},
    )


def _origin_keys(role: str) -> tuple[str, str]:
    return ("source", "sha256") if role == "log" else (f"{role}_source", f"{role}_sha256")


def _find_log(folder: Path, name: str, table: dict[str, Any]) -> Path:
    """The log's file under its name, one of its other names, or the file name of its source."""
    paths = [folder / (each + ending) for each in _file_stems(name, table) for ending in LOG_SUFFIXES]
    source: str = table.get("source", "")
    downloaded = PurePosixPath(urlsplit(source).path).name
    if downloaded.endswith(LOG_SUFFIXES[:-1]):
        paths += [folder / downloaded, folder / downloaded.removesuffix(".gz")]
    return next((path for path in paths if path.exists()), paths[0])


def _find_reference(folder: Path, name: str, table: dict[str, Any], role: str) -> Path:
    """The file of relations or reference as named; for an optional log, also under one of the log's names."""
    named = folder / path_of_name(table[role])
    if not table.get("optional"):
        return named
    paths = [named, *(named.with_name(each + named.suffix) for each in _file_stems(name, table))]
    return next((path for path in paths if path.exists()), named)


def _file_stems(name: str, table: dict[str, Any]) -> list[str]:
    return [name, *table.get("also", [])]


def _abbreviated(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 50 else f"{text[:47]}..."


def _is_non_negative(value: Any) -> bool:
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and value >= 0
    return good and math.isfinite(value)


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and LOG_NAME.fullmatch(value) is not None


KeyCheck = tuple[Callable[[Any], bool], str]
"""Whether a value is valid, and what it has to be."""
TEXT: KeyCheck = (lambda value: isinstance(value, str) and value != "", "a text")
BOUND: KeyCheck = (_is_non_negative, "a number that is not negative")
HASH: KeyCheck = (
    lambda value: isinstance(value, str) and SHA256.fullmatch(value) is not None,
    "64 hexadecimal digits, in small letters",
)
KEY_CHECKS: dict[str, KeyCheck] = {
    "name": TEXT,
    "path": TEXT,
    "also": (
        lambda value: isinstance(value, list) and all(map(_is_name, value)),
        'names of files without their endings, as in ["intel-lab"]',
    ),
    "optional": (lambda value: isinstance(value, bool), "true or false"),
    **dict.fromkeys(("about", "published_map", "relations", "reference"), TEXT),
    **dict.fromkeys(("max_translation", "max_rotation"), BOUND),
    "published": (
        lambda value: isinstance(value, dict) and all(map(_is_non_negative, value.values())),
        'errors in metres by method, as in { "RBPF" = 0.070 }',
    ),
    "parameters": (lambda value: isinstance(value, dict), "a table of options, as in { end = 60 }"),
    "source": TEXT,
    "sha256": HASH,
    "relations_source": TEXT,
    "relations_sha256": HASH,
    "reference_source": TEXT,
    "reference_sha256": HASH,
}
"""The keys of a [[log]] table."""
