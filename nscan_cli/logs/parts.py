"""Which files a log consists of: one, the files of a folder, or those of a recording that was split."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from nscan_cli.counting import counted
from nscan_cli.errors import InputMissingError, WrongUsageError
from nscan_cli.inputs import STANDARD_INPUT, base_name, label, read_bytes
from nscan_cli.limits import CONFIG
from nscan_cli.logs.kinds import FORMS
from nscan_cli.logs.packing import SUFFIXES

METADATA = "metadata.yaml"
RECORDINGS = (".mcap", ".db3", ".bag")
"""What names of recordings end with, before what compression and an unfinished recording add."""
ACTIVE = ".active"
"""Of a bag that is being recorded, or whose recorder was killed."""
SQLITE = b"SQLite format 3\0"
BESIDE = ("-wal", "-journal")
"""What is added to the name of a database for what has not been taken into it yet."""
NUMBERED = re.compile(r"(?P<of>.*?)_?(?P<number>\d+)")
"""The name of a part, which a recorder ends with _0, _1, …."""
DATE = re.compile(r"_?\d{4}(-\d\d){5}")
"""ROS 1 adds to each part's name the time at which it was begun."""
LISTED = re.compile(r"^ *relative_file_paths:.*(\n *- .*)*", re.MULTILINE)
"""The part of metadata.yaml that names the files."""
NAMED = 5
"""Files that a message names at most."""


@dataclass(frozen=True)
class Parts:
    """The files of one log."""

    title: str
    """As messages call the log."""
    name: str
    """As results call it: the same on every machine."""
    files: tuple[str, ...]
    """Their paths."""
    warnings: tuple[str, ...] = ()
    """What a user should know of the choice."""
    are_parts: bool = True
    """Whether metadata.yaml or their names say that they are parts of one recording."""


@dataclass(frozen=True)
class Part:
    """A name of a file, taken apart."""

    file: str
    recording: tuple[str, str]
    """Its name without number, date and endings, and the ending that tells the form."""
    number: int | None


def parts_of(paths: str | Sequence[str]) -> Parts:
    """The files of the log that these paths name: a file, "-", a folder, or the files of one recording.

    Raises InputMissingError when a folder holds none, WrongUsageError when the paths are of several.
    """
    named = [paths] if isinstance(paths, str) else list(paths)
    if len(named) == 1:
        (path,) = named
        if os.path.isdir(path):
            return _of_folder(path)
        warnings = () if path == STANDARD_INPUT else _siblings(path)
        return Parts(label(path), base_name(path), (path,), warnings)
    if STANDARD_INPUT in named:
        raise WrongUsageError(
            "standard input (-) can be no part of a recording; give all files by their paths"
        )
    for path in named:
        if os.path.isdir(path):
            raise WrongUsageError(
                f"{path}: is a folder beside other LOGs; give it alone, or the files of one recording"
            )
    if len({os.path.realpath(path) for path in named}) < len(named):
        raise WrongUsageError(f"{named[-1]}: one of the LOGs is given twice; give each once")
    files = [path for path in named if not any(path == other + end for other in named for end in BESIDE)]
    parts = _in_order(files)
    agree = len({part.recording for part in parts}) == 1 and _distinct(parts)
    name = _common(parts) if agree else ", ".join(base_name(part.file) for part in parts)
    title = f"{parts[0].file} and {counted(len(parts) - 1, 'other')}" if len(parts) > 1 else parts[0].file
    return Parts(title, name, tuple(part.file for part in parts), _gaps(parts, first=None), agree)


def files_of(paths: str | Sequence[str]) -> list[str]:
    """The paths of all files that are read for a log, with what stands beside databases; "-" is one too.

    Raises the errors of parts_of.
    """
    return [one for path in parts_of(paths).files for one in (path, *beside(path).values())]


def beside(path: str) -> dict[str, str]:
    """The paths of what has not been taken into the database at `path` yet, by what their names add.

    None when it is no database. As SQLite does, it is looked for beside the file that a link leads to.
    """
    if path == STANDARD_INPUT or not first_bytes(path).startswith(SQLITE):
        return {}
    database = os.path.realpath(path) if os.path.islink(path) else path
    names = {end: database + end for end in BESIDE}
    return {end: name for end, name in names.items() if os.path.isfile(name) and os.path.getsize(name)}


def _of_folder(path: str) -> Parts:
    """The recording in a folder: as its metadata.yaml says, else the only one that is there."""
    folder = Path(path)
    try:
        names = sorted(name for name in os.listdir(folder) if not name.startswith("."))
    except OSError as error:
        raise InputMissingError(f"{path}: cannot be read: {error.strerror}; check the path") from error
    there = [name for name in names if _is_recording(folder / name)]
    name = Path(os.path.abspath(path)).name
    warnings: list[str] = []
    listed = _listed(folder, warnings) if METADATA in names else []
    known = {_without_packing(one): one for one in there}
    found = [one if one in there else known.get(_without_packing(one)) for one in listed]
    files = [one for one in found if one is not None]
    if listed and not files and there:
        warnings.append(f"{METADATA} names other files than {_some(there)}, which is there and is read")
    elif listed:
        gone = [one for one, other in zip(listed, found, strict=True) if other is None]
        if gone and files:
            warnings.append(f"{_some(gone)} is not there, which {METADATA} names: what it held is missing")
        twins = {_without_packing(one) for one in files}
        more = [one for one in there if _without_packing(one) not in twins]
        if more:
            warnings.append(f"{_some(more)} is not in {METADATA}, and is left out")
    if not files:
        files = _alone(path, there, names)
        warnings += _gaps(_in_order(files), first=0)
    in_order = [part.file for part in _in_order(files)]
    return Parts(path, name, tuple(str(folder / one) for one in in_order), tuple(warnings))


def _alone(path: str, there: list[str], names: list[str]) -> list[str]:
    """The files of the only recording among those of a folder."""
    if not there:
        held = [f"{name}/" if os.path.isdir(os.path.join(path, name)) else name for name in names]
        holds = f"it holds {_some(held)}" if held else "it is empty"
        raise InputMissingError(
            f"{path}: is a folder without a recording, {holds}; "
            "name a log, or a folder that `ros2 bag record` has left"
        )
    plain = {_without_packing(one): one for one in sorted(there, key=len, reverse=True)}
    parts = _in_order(plain.values())
    if len({part.recording for part in parts}) > 1 or not _distinct(parts):
        raise WrongUsageError(f"{path}: holds several recordings, {_some(there)}; name the files of one")
    return [part.file for part in parts]


def _siblings(path: str) -> tuple[str, ...]:
    """What a user should know who has named one of several files of a recording."""
    if _taken_apart(path).number is None or not any(end in path for end in RECORDINGS):
        return ()
    file = Path(os.path.realpath(path))
    if (file.parent / METADATA).is_file():
        listed = _listed(file.parent, [])
        if len(listed) > 1 and file.name in listed:
            place, whole = listed.index(file.name) + 1, f"its folder {Path(path).parent}"
            return (f"it is file {place} of {len(listed)} of a recording: give {whole} to read all of it",)
    own = _taken_apart(file.name)
    try:
        names = os.listdir(file.parent)
    except OSError:
        return ()
    parts = _in_order(name for name in names if _taken_apart(name).recording == own.recording)
    numbers = [part.number for part in parts]
    if len(parts) < 2 or numbers != list(range(len(parts))):
        return ()
    place = numbers.index(own.number) + 1
    return (f"it is file {place} of {len(parts)} of a recording: give all of them, {parts[0].file} to "
            f"{parts[-1].file}, to read all of it",)  # fmt: skip


def _listed(folder: Path, warnings: list[str]) -> list[str]:
    """The names of the files that metadata.yaml names; none, and a warning, when it cannot be read."""
    from ruamel.yaml import YAML

    try:
        # The rest, which may be long, is of no use.
        text = LISTED.search(read_bytes(str(folder / METADATA), CONFIG).decode())
        document: Any = YAML(typ="safe", pure=True).load(text.group() if text else "")
        # Only what is in the folder: some versions name it too.
        names = [PurePosixPath(str(name)).name for name in document["relative_file_paths"]]
    except Exception as error:
        # Whatever a parser raises, and what a document of another shape leads to.
        warnings.append(f"{METADATA} cannot be read, and is left out ({type(error).__name__})")
        return []
    return list(dict.fromkeys(name for name in names if name))


def _is_recording(path: Path) -> bool:
    """Whether a file is a recording, by its first bytes, or is called one."""
    if not path.is_file():
        return False
    head = first_bytes(str(path))
    magic = any(form.magic is not None and head.startswith(form.magic) for form in FORMS if form.container)
    return magic or _taken_apart(path.name).recording[1] != ""


def first_bytes(path: str) -> bytes:
    """The first bytes of a regular file; none when it is not there."""
    try:
        if os.path.isfile(path):
            with open(path, "rb") as file:
                return file.read(16)
    except (OSError, ValueError):
        pass
    return b""


def _without_packing(name: str) -> str:
    return next((name[: -len(end)] for end in SUFFIXES if name.lower().endswith(end)), name)


def _taken_apart(path: str) -> Part:
    name = _without_packing(Path(path).name).removesuffix(ACTIVE)
    stem, end = os.path.splitext(name)
    if end.lower() not in RECORDINGS:
        return Part(path, (name, ""), None)
    numbered = NUMBERED.fullmatch(stem)
    if numbered is None or stem not in (numbered["number"], f"{numbered['of']}_{numbered['number']}"):
        return Part(path, (stem, end.lower()), None)
    return Part(path, (DATE.sub("", numbered["of"]), end.lower()), int(numbered["number"]))


def _in_order(files: Iterable[str]) -> list[Part]:
    """The parts in the order of their numbers, whatever the order of the files."""
    parts = [_taken_apart(file) for file in files]
    return sorted(parts, key=lambda part: (part.number is None, part.number or 0, part.file))


def _distinct(parts: Sequence[Part]) -> bool:
    """Whether each part has a number of its own."""
    numbers = [part.number for part in parts]
    return len(parts) == 1 or (None not in numbers and len(set(numbers)) == len(numbers))


def _common(parts: Sequence[Part]) -> str:
    """What the parts of a recording are called together."""
    return parts[0].recording[0] or base_name(parts[0].file)


def _gaps(parts: Sequence[Part], first: int | None) -> tuple[str, ...]:
    """Numbers that are missing between those of the parts, counted from `first` where it is given."""
    numbers = [part.number for part in parts if part.number is not None]
    if not numbers or not _distinct(parts):
        return ()
    low = min(numbers) if first is None else first
    missing = [str(number) for number in range(low, min(max(numbers), low + 10_000)) if number not in numbers]
    if not missing:
        return ()
    return (f"of its parts, number {_some(missing)} is not there: what it held is missing",)


def _some(names: Sequence[str]) -> str:
    """Names for a message, not too many."""
    more = f" and {counted(len(names) - NAMED, 'other')}" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
