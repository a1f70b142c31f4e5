"""File names of split recordings: the recording that a file belongs to, and the number of the part."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from nscan_cli.files.inputs import base_name
from nscan_cli.files.text import shortened_list
from nscan_cli.logs.compression import SUFFIXES

RECORDING_SUFFIXES = (".mcap", ".db3", ".bag")
"""Endings of the names of recordings, before those of compression and of unfinished bags."""
ROS2_SUFFIXES = (".mcap", ".db3")
"""Those of `ros2 bag record`, which writes a folder with the name of the recording."""
UNFINISHED_SUFFIX = ".active"
"""Suffix of a bag that is being recorded, or whose recorder was killed."""
NUMBERED_STEM = re.compile(r"(?P<of>.*?)_?(?P<number>\d{1,9})")
"""Recorders end the names of parts with _0, _1, …."""
DATE = re.compile(r"_?\d{4}(-\d\d){5}")
"""ROS 1 adds the start time to the name of each part."""


@dataclass(frozen=True)
class RecordingFile:
    """A file, with what its name says."""

    file: str
    recording: tuple[str, str]
    """The name without number, date and endings; and the ending, empty if it is none of a recording."""
    number: int | None
    """Number of the part; None without one."""


def without_compression(name: str) -> str:
    """The name that a compressed file has after unpacking."""
    return next((name[: -len(end)] for end in SUFFIXES if name.lower().endswith(end)), name)


def parse_name(path: str) -> RecordingFile:
    """What the name of the file at a path says."""
    name = without_compression(Path(path).name).removesuffix(UNFINISHED_SUFFIX)
    stem, end = os.path.splitext(name)
    if end.lower() not in RECORDING_SUFFIXES:
        return RecordingFile(path, (name, ""), None)
    numbered = NUMBERED_STEM.fullmatch(stem)
    if numbered is None or stem not in (numbered["number"], f"{numbered['of']}_{numbered['number']}"):
        return RecordingFile(path, (stem, end.lower()), None)
    return RecordingFile(path, (DATE.sub("", numbered["of"]), end.lower()), int(numbered["number"]))


def sorted_parts(files: Iterable[str]) -> list[RecordingFile]:
    """The files by the numbers of their parts, those without a number last."""
    parts = [parse_name(file) for file in files]
    return sorted(parts, key=lambda part: (part.number is None, part.number or 0, part.file))


def have_own_numbers(parts: Sequence[RecordingFile]) -> bool:
    """Whether each part has a number of its own."""
    numbers = [part.number for part in parts]
    return len(parts) == 1 or (None not in numbers and len(set(numbers)) == len(numbers))


def common_name(parts: Sequence[RecordingFile]) -> str:
    """The name of the recording that the parts belong to."""
    return parts[0].recording[0] or base_name(parts[0].file)


def missing_parts(parts: Sequence[RecordingFile], first: int | None) -> tuple[str, ...]:
    """A warning when numbers are missing between `first` (default: the lowest) and the highest."""
    numbers = [part.number for part in parts if part.number is not None]
    if not numbers or not have_own_numbers(parts):
        return ()
    low = min(numbers) if first is None else first
    missing = [str(number) for number in range(low, min(max(numbers), low + 10_000)) if number not in numbers]
    if not missing:
        return ()
    return (f"parts are missing: number {shortened_list(missing)}",)
