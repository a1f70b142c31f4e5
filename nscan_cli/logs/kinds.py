"""What a file is, by its content: the forms of log that are read, and names for what is none of them."""

from __future__ import annotations

import importlib
import re
from typing import Any, NamedTuple


class Form(NamedTuple):
    """A form of log, and the module that reads it, which is imported when such a log is met.

    The module has `read`, as logs.load.Reader says; for a text without `magic` also `recognises`.
    """

    name: str
    module: str
    magic: bytes | None = None
    """The first bytes of such a file; None: the module is asked."""
    container: bool = False
    """Whether it holds messages: the module then has `recording`, too."""

    def fits(self, data: bytes) -> bool:
        """Whether these bytes are of this form."""
        if self.magic is not None:
            return data.startswith(self.magic)
        recognised: bool = self.reader().recognises(data)
        return recognised

    def reader(self) -> Any:
        """The module."""
        return importlib.import_module(self.module)


FORMS: tuple[Form, ...] = (
    Form("MCAP", "nscan_cli.logs.mcap_log", b"\x89MCAP0\r\n", container=True),
    Form("ROS 1 bag", "nscan_cli.logs.rosbag1", b"#ROSBAG V2.0\n", container=True),
    Form("ROS 2 bag", "nscan_cli.logs.rosbag2", b"SQLite format 3\0", container=True),
    Form("CARMEN text", "nscan_cli.logs.carmen"),
    Form("Player text", "nscan_cli.logs.player"),
    Form(".script text", "nscan_cli.logs.script"),
)
"""In order of trial. A new form of log is a module and a line here."""


def readable() -> str:
    """The forms that are read, as messages name them."""
    return f"{', '.join(form.name for form in FORMS)}; plain or packed by gzip"


MAGIC = (
    (b"#ROSBAG V", "a ROS 1 bag of an old version"),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"P5", "a PGM picture"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\xfd7zXZ\0", "compressed by xz"),
    (b"BZh", "compressed by bzip2"),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd"),
    (b"\x04\x22\x4d\x18", "compressed by lz4"),
    (b"\x1f\x8b", "compressed by gzip twice"),
    (b"\x7fELF", "a program"),
)
"""What the first bytes say."""

TEXT = (
    (rb"\[{1,2}[\w.-]+\]{1,2}\s*$", "TOML or INI text"),
    (rb'\{"format": ?"nscan-pose-graph"', "a pose graph (JSON)"),
    (rb"[{\[]", "JSON text"),
    (rb"<", "HTML or XML text"),
    (rb"(VERTEX_SE2|EDGE_SE2|VERTEX2|EDGE2|VERTEX_SE3:QUAT|EDGE_SE3:QUAT)\s", "a pose graph (g2o or TORO)"),
    (rb"(LASER_READING|GFS_\w+)\s", "a GMapping .gfs file"),
    (rb"(@SENS|@OPEN|#ROBOT|#LASER)\s", "a BeeSoft .rec log"),
    (rb"(image|resolution):", "a map's YAML file"),
    (rb"([-+.\deE]+[ \t]+){7}[-+.\deE]+\s*$", "a list of eight numbers a line, as of poses or relations"),
)
"""What the first line says that is neither blank nor a comment."""

FIRST_LINE = re.compile(rb"^[ \t]*([^\s#][^\r\n]*)", re.MULTILINE)


def name_of(data: bytes) -> str:
    """What `data` is, as the end of the sentence "the file is …"; "of an unknown kind" when in doubt."""
    for magic, name in MAGIC:
        if data.startswith(magic):
            return name
    if data[257:262] == b"ustar":
        return "a tar archive"
    if b"\0" in data[:4096]:
        return "binary data of an unknown kind"
    line = FIRST_LINE.search(data, 0, 1 << 16)
    for pattern, name in TEXT:
        if line and re.match(pattern, line.group(1)):
            return name
    return "of an unknown kind"
