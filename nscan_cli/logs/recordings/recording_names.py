"""Names of the files of recordings: of which recording, and the number that its recorder gave the file."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from nscan_cli.files.counting import counted
from nscan_cli.files.inputs import base_name
from nscan_cli.logs.compression import SUFFIXES

RECORDINGS = (".mcap", ".db3", ".bag")
"""What names of recordings end with, before what compression and an unfinished recording add."""
ACTIVE = ".active"
"""Of a bag that is being recorded, or whose recorder was killed."""
NUMBERED = re.compile(r"(?P<of>.*?)_?(?P<number>\d{1,9})")
"""The name of a part, which a recorder ends with _0, _1, …."""
DATE = re.compile(r"_?\d{4}(-\d\d){5}")
"""ROS 1 adds to each part's name the time at which it was begun."""
NAMED = 5
"""Files that a message names at most."""


@dataclass(frozen=True)
class RecordingFile:
    """A name of a file, taken apart."""

    file: str
    recording: tuple[str, str]
    """Its name without number, date and endings, and the ending that tells the form."""
    number: int | None


def without_packing(name: str) -> str:
    """The name that a compressed file has when it is unpacked."""
    return next((name[: -len(end)] for end in SUFFIXES if name.lower().endswith(end)), name)


def taken_apart(path: str) -> RecordingFile:
    """The name of the file at a path; of what is not called a recording the ending is empty."""
    name = without_packing(Path(path).name).removesuffix(ACTIVE)
    stem, end = os.path.splitext(name)
    if end.lower() not in RECORDINGS:
        return RecordingFile(path, (name, ""), None)
    numbered = NUMBERED.fullmatch(stem)
    if numbered is None or stem not in (numbered["number"], f"{numbered['of']}_{numbered['number']}"):
        return RecordingFile(path, (stem, end.lower()), None)
    return RecordingFile(path, (DATE.sub("", numbered["of"]), end.lower()), int(numbered["number"]))


def in_order(files: Iterable[str]) -> list[RecordingFile]:
    """The parts in the order of their numbers, whatever the order of the files."""
    parts = [taken_apart(file) for file in files]
    return sorted(parts, key=lambda part: (part.number is None, part.number or 0, part.file))


def distinct(parts: Sequence[RecordingFile]) -> bool:
    """Whether each part has a number of its own."""
    numbers = [part.number for part in parts]
    return len(parts) == 1 or (None not in numbers and len(set(numbers)) == len(numbers))


def common(parts: Sequence[RecordingFile]) -> str:
    """What the parts of a recording are called together."""
    return parts[0].recording[0] or base_name(parts[0].file)


def gaps(parts: Sequence[RecordingFile], first: int | None) -> tuple[str, ...]:
    """Numbers that are missing between those of the parts, counted from `first` where it is given."""
    numbers = [part.number for part in parts if part.number is not None]
    if not numbers or not distinct(parts):
        return ()
    low = min(numbers) if first is None else first
    missing = [str(number) for number in range(low, min(max(numbers), low + 10_000)) if number not in numbers]
    if not missing:
        return ()
    return (f"of its parts, number {some(missing)} is not there: what it held is missing",)


def some(names: Sequence[str]) -> str:
    """Names for a message, not too many."""
    more = f" and {counted(len(names) - NAMED, 'other')}" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
