"""The columns of time, position and quaternion in a table of poses, by their names or their number.

TUM: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats. EuRoC (state_groundtruth_estimate0):
M. Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016; times in ns, w before x, y, z.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from nscan_cli.files.encoding import BYTE_ORDER_MARK

COMMENT_MARKS = "#%"
"""First characters of comment lines, which may name the columns."""
UNIT_IN_NAME = re.compile(r"[\[(].*?[\])]")
"""A unit in brackets, as in `time [s]`."""
WORD_IN_NAME = re.compile(r"[a-z]+|[0-9]+")
ROTATION_PREFIXES = ("quat", "orient", "rot")
"""Beginnings of the words that name a quaternion, besides q."""
OTHER_VECTORS = ("v", "w", "b", "a", "twist", "vel", "linear", "angular", "covariance", "cov", "acc", "gyro")
"""Words that name other vectors with x, y and z, such as velocities and biases."""
POSITION_NAMES = ("", "t", "p", "pos", "position", "trans", "translation")
"""Words before the axis in the name of a coordinate."""
SECOND_UNITS = ("s", "sec", "secs", "seconds")
NANOSECOND_UNITS = ("ns", "nsec", "nsecs", "nanosec", "nanoseconds")
TIME_POWERS = (
    {"ms": 3, "us": 6, "µs": 6} | dict.fromkeys(SECOND_UNITS, 0) | dict.fromkeys(NANOSECOND_UNITS, 9)
)
"""Unit of time → the power of ten of its count per second."""
UNIT_TOLERANCE = 0.01
"""Largest difference of a quaternion's length from 1, as rounding to a few digits makes it."""
LATEST_SECONDS, POWER_STEP = 1e11, 1000
"""Times beyond LATEST_SECONDS are in ms, those beyond POWER_STEP times that in µs, and later ones in ns."""


@dataclass(frozen=True)
class PoseColumns:
    """The column numbers of a table, from 0."""

    time: int
    position: tuple[int, int, int | None]
    """x, y and z; z may be missing."""
    rotation: tuple[int, int, int, int]
    """x, y, z and w of the quaternion."""
    power: int | None = None
    """The power of ten that times are divided by; None where it is not known."""
    count: int | None = None
    """The number of columns that a line must have; None: at least those that are used."""
    nanoseconds: int | None = None
    """The column of the nanoseconds, where the time is in whole seconds."""

    @property
    def least(self) -> int:
        """The smallest number of columns of a line."""
        places = (self.time, *self.rotation, *self.position, self.nanoseconds)
        return 1 + max(place for place in places if place is not None)

    def stamp(self, fields: Sequence[str], power: int) -> str:
        """The time of a line as text in seconds, with all its digits."""
        time = fields[self.time]
        if self.nanoseconds is not None:
            return in_seconds(str(int(time) * 10**9 + int(fields[self.nanoseconds])), 9)
        return in_seconds(time, power)


TUM = PoseColumns(0, (1, 2, 3), (4, 5, 6, 7), count=8)
EUROC = PoseColumns(0, (1, 2, 3), (5, 6, 7, 4), power=9)
EUROC_COUNT = 17
"""The columns of EuRoC with velocity and biases."""


def split_fields(line: str) -> list[str]:
    """The fields between commas, semicolons, tabs or spaces. With semicolons, commas are decimal."""
    if ";" in line:
        fields = line.replace(",", ".").split(";")
    elif "," in line:
        fields = line.split(",")
    else:
        return line.split()
    fields = [field.strip().strip("\"'") for field in fields]
    return fields if any(fields) and fields[-1] else fields[:-1] if any(fields) else []


def numbered_lines(data: bytes) -> Iterator[tuple[int, str]]:
    """The lines of a text that are not blank, with their numbers, without a byte-order mark."""
    for number, line in enumerate(io.BytesIO(data.removeprefix(BYTE_ORDER_MARK)), start=1):
        text = line.decode("utf-8", errors="replace").strip()
        if text:
            yield number, text


def columns_by_name(line: str) -> PoseColumns | None:
    """The columns by the names in a line; None where a time, a position or a quaternion is missing."""
    found: dict[str, int] = {}
    power, whole = None, False
    fields = split_fields(line.lstrip(COMMENT_MARKS).strip())
    for at, field in enumerate(fields):
        name = UNIT_IN_NAME.sub("", field).strip().lower()
        words = WORD_IN_NAME.findall(name)
        if not words:
            continue
        what = _quantity(words)
        if what == "time" and what not in found:
            unit = "".join(UNIT_IN_NAME.findall(field)).strip("[]() ").lower() or words[-1]
            power, whole = TIME_POWERS.get(unit), words[-1] in SECOND_UNITS
        elif what == "time" and whole and words[-1] in NANOSECOND_UNITS:
            what = "nanoseconds"
        if what:
            found.setdefault(what, at)
    try:
        rotation = found["qx"], found["qy"], found["qz"], found["qw"]
        position = found["x"], found["y"], found.get("z")
        return PoseColumns(found["time"], position, rotation, power, nanoseconds=found.get("nanoseconds"))
    except KeyError:
        return None


def _quantity(words: list[str]) -> str:
    """The quantity of a column by the words of its name: time, x, y, z, qx, qy, qz, qw, or "" for others."""
    if words[0].startswith("time") or words[-1] in ("t", "stamp", *SECOND_UNITS, *NANOSECOND_UNITS):
        return "time"
    axis, before = words[-1][-1], words[-1][:-1]
    if axis not in "xyzw":
        return ""
    parts = [*words[:-1], before]
    if any(part == "q" or part.startswith(ROTATION_PREFIXES) for part in parts):
        return f"q{axis}"
    if axis == "w" or any(part in OTHER_VECTORS for part in parts) or before not in POSITION_NAMES:
        return ""
    return axis


def columns_by_content(line: str) -> PoseColumns:
    """The columns by the first line of numbers, where no line names them.

    A line with nanoseconds and commas is EuRoC's; other lines have to be TUM's.
    """
    fields = split_fields(line)
    if len(fields) >= EUROC_COUNT or (
        "," in line and ";" not in line and power_by_size(fields[0]) == TIME_POWERS["ns"]
    ):
        return EUROC
    return TUM


def is_header(line: str) -> bool:
    """Whether a line is a header of column names or a comment."""
    return line[0] in COMMENT_MARKS or not _is_number(split_fields(line)[0])


def power_by_size(time: str) -> int:
    """The power of ten that converts a time to seconds, by its size; see LATEST_SECONDS."""
    size, power = abs(float(time)), 0
    while size > LATEST_SECONDS * POWER_STEP ** (power / 3) and power < TIME_POWERS["ns"]:
        power += 3
    return power


def in_seconds(time: str, power: int) -> str:
    """A time in seconds as text, with all its digits."""
    if power == 0:
        return time
    try:
        whole, rest = divmod(int(time), 10**power)
    except ValueError:
        return repr(float(time) / 10**power)
    return f"{whole}.{rest:0{power}d}"


def is_pose_table(data: bytes) -> bool:
    """Whether a text is a table of poses: its first line names their columns, or has numbers only."""
    for _number, line in numbered_lines(data):
        if columns_by_name(line) is not None:
            return True
        if line[0] not in COMMENT_MARKS:
            return all(_is_number(field) for field in split_fields(line))
    return False


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
