"""The files of a log: one file, those of a folder, or the parts of a split recording."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from nscan_cli.errors import InputMissingError, WrongUsageError
from nscan_cli.files.inputs import STANDARD_INPUT, base_name, label, read_bytes
from nscan_cli.files.limits import CONFIG
from nscan_cli.files.text import counted, shortened_list
from nscan_cli.logs.formats import FORMS
from nscan_cli.logs.recordings.split_file_names import (
    RECORDING_SUFFIXES,
    common_name,
    have_own_numbers,
    missing_parts,
    parse_name,
    sorted_parts,
    without_compression,
)

METADATA = "metadata.yaml"
SQLITE_MAGIC = b"SQLite format 3\0"
JOURNAL_SUFFIXES = ("-wal", "-journal")
"""Suffixes of the files beside a database with changes that are not yet in it."""
SHARED_MEMORY_SUFFIX = "-shm"
"""Suffix of the memory shared by processes that have the database open. It holds no data."""
FILE_LIST = re.compile(r"^ *relative_file_paths:.*(\n *- .*)*", re.MULTILINE)
"""The part of metadata.yaml that lists the files."""


@dataclass(frozen=True)
class Parts:
    """The files of one log."""

    title: str
    """Name of the log in messages."""
    name: str
    """Name of the log in results, the same on every machine."""
    files: tuple[str, ...]
    """Paths of the files."""
    warnings: tuple[str, ...] = ()
    """Notes for the user about the choice of files."""
    are_parts: bool = True
    """Whether metadata.yaml or their names say that they are parts of one recording."""


def parts_of(paths: str | Sequence[str]) -> Parts:
    """The files of the log at these paths: a file, "-", a folder, or the files of one recording.

    Raises InputMissingError if a folder holds none, and WrongUsageError if the paths belong to several.
    """
    named = [paths] if isinstance(paths, str) else _without_journals(paths)
    if len(named) == 1:
        (path,) = named
        if os.path.isdir(path):
            return _parts_in_folder(path)
        warnings = () if path == STANDARD_INPUT else _note_on_siblings(path)
        return Parts(label(path), base_name(path), (path,), warnings)
    if STANDARD_INPUT in named:
        raise WrongUsageError(
            "standard input (-) cannot be a part of a recording; give all files by their paths"
        )
    for path in named:
        if os.path.isdir(path):
            raise WrongUsageError(
                f"{path}: is a folder beside other LOGs; give it alone, or the files of one recording"
            )
    if len({os.path.realpath(path) for path in named}) < len(named):
        raise WrongUsageError(f"{named[-1]}: one of the LOGs is given twice; give each once")
    parts = sorted_parts(named)
    agree = len({part.recording for part in parts}) == 1 and have_own_numbers(parts)
    name = common_name(parts) if agree else ", ".join(base_name(part.file) for part in parts)
    title = f"{parts[0].file} and {counted(len(parts) - 1, 'other')}"
    return Parts(title, name, tuple(part.file for part in parts), missing_parts(parts, first=None), agree)


def _without_journals(paths: Sequence[str]) -> list[str]:
    """The paths without metadata and journals, which a shell's * also names."""
    journals = {path + end for path in paths for end in (*JOURNAL_SUFFIXES, SHARED_MEMORY_SUFFIX)}
    kept = [path for path in paths if path not in journals and Path(path).name != METADATA]
    return kept or list(paths)


def files_of(paths: str | Sequence[str]) -> list[str]:
    """The paths of all files that are read for a log, with the journals of databases; "-" is one too.

    Raises the errors of parts_of.
    """
    return [one for path in parts_of(paths).files for one in (path, *journals_of(path).values())]


def journals_of(path: str) -> dict[str, str]:
    """The journals of the database at `path`, as {suffix: path}; empty if it is no database.

    As in SQLite, they are beside the file that a link leads to.
    """
    if path == STANDARD_INPUT or not first_bytes(path).startswith(SQLITE_MAGIC):
        return {}
    database = os.path.realpath(path) if os.path.islink(path) else path
    names = {end: database + end for end in JOURNAL_SUFFIXES}
    return {end: name for end, name in names.items() if os.path.isfile(name) and os.path.getsize(name)}


def _parts_in_folder(path: str) -> Parts:
    """The recording in a folder: the one that its metadata.yaml lists, else the only one."""
    folder = Path(path)
    try:
        names = sorted(name for name in os.listdir(folder) if not name.startswith("."))
    except OSError as error:
        raise InputMissingError(f"{path}: cannot be read: {error.strerror}; check the path") from error
    there = [name for name in names if _is_recording(folder / name)]
    name = Path(os.path.abspath(path)).name
    warnings: list[str] = []
    listed = _listed_files(folder, warnings) if METADATA in names else []
    known = {without_compression(one): one for one in there}
    found = [one if one in there else known.get(without_compression(one)) for one in listed]
    files = [one for one in found if one is not None]
    if listed and not files and there:
        warnings.append(
            f"{METADATA} lists other files than {shortened_list(there)}, which is in the folder and is read"
        )
    elif listed:
        gone = [one for one, other in zip(listed, found, strict=True) if other is None]
        if gone and files:
            warnings.append(
                f"{shortened_list(gone)} is missing, though {METADATA} lists it: its scans are missing too"
            )
        twins = {without_compression(one) for one in files}
        more = [one for one in there if without_compression(one) not in twins]
        if more:
            warnings.append(f"{shortened_list(more)} is not listed in {METADATA} and is not read")
    if not files:
        files = _only_recording(path, there, names)
        warnings += missing_parts(sorted_parts(files), first=0)
    ordered = tuple(str(folder / part.file) for part in sorted_parts(files))
    return Parts(path, name, ordered, tuple(warnings))


def _only_recording(path: str, there: list[str], names: list[str]) -> list[str]:
    """The files of the only recording in a folder. Raises InputMissingError and WrongUsageError."""
    if not there:
        held = [f"{name}/" if os.path.isdir(os.path.join(path, name)) else name for name in names]
        holds = f"it holds {shortened_list(held)}" if held else "it is empty"
        raise InputMissingError(
            f"{path}: is a folder without a recording, {holds}; "
            "name a log, or a folder written by `ros2 bag record`"
        )
    plain = {without_compression(one): one for one in sorted(there, key=len, reverse=True)}
    parts = sorted_parts(plain.values())
    if len({part.recording for part in parts}) > 1 or not have_own_numbers(parts):
        raise WrongUsageError(
            f"{path}: holds several recordings, {shortened_list(there)}; name the files of one"
        )
    return [part.file for part in parts]


def _note_on_siblings(path: str) -> tuple[str, ...]:
    """A note for a user who has named one of several files of a recording."""
    if parse_name(path).number is None or not any(end in path for end in RECORDING_SUFFIXES):
        return ()
    file = Path(os.path.realpath(path))
    if (file.parent / METADATA).is_file():
        listed = _listed_files(file.parent, [])
        if len(listed) > 1 and file.name in listed:
            place, whole = listed.index(file.name) + 1, f"its folder {Path(path).parent}"
            return (f"it is file {place} of {len(listed)} of a recording: give {whole} to read all of it",)
    own = parse_name(file.name)
    try:
        names = os.listdir(file.parent)
    except OSError:
        return ()
    parts = sorted_parts(name for name in names if parse_name(name).recording == own.recording)
    numbers = [part.number for part in parts]
    if len(parts) < 2 or numbers != list(range(len(parts))):
        return ()
    place = numbers.index(own.number) + 1
    return (f"it is file {place} of {len(parts)} of a recording: give all of them, {parts[0].file} to "
            f"{parts[-1].file}, to read all of it",)  # fmt: skip


def _listed_files(folder: Path, warnings: list[str]) -> list[str]:
    """The file names that metadata.yaml lists; none, with a warning, if it cannot be read."""
    from ruamel.yaml import YAML

    try:
        # The rest may be long and is not needed.
        text = FILE_LIST.search(read_bytes(str(folder / METADATA), CONFIG).decode())
        document: Any = YAML(typ="safe", pure=True).load(text.group() if text else "")
        # Some versions also write the folder.
        names = [PurePosixPath(str(name)).name for name in document["relative_file_paths"]]
    except Exception as error:
        # Parsers raise various errors, and so does a document of another structure.
        warnings.append(f"{METADATA} cannot be read and is ignored ({type(error).__name__})")
        return []
    return list(dict.fromkeys(name for name in names if name))


def _is_recording(path: Path) -> bool:
    if not path.is_file():
        return False
    head = first_bytes(str(path))
    magic = any(form.magic is not None and head.startswith(form.magic) for form in FORMS if form.container)
    return magic or parse_name(path.name).recording[1] != ""


def first_bytes(path: str) -> bytes:
    """The first 16 bytes of a regular file; empty if it cannot be read."""
    try:
        if os.path.isfile(path):
            with open(path, "rb") as file:
                return file.read(16)
    except (OSError, ValueError):
        pass
    return b""
