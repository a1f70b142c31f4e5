"""What a file is, by its content: the forms of log that are read, and names for what is none of them."""

from __future__ import annotations

import importlib
import re
from typing import Any, NamedTuple

from nscan_cli.files.inputs import FileBytes
from nscan_cli.logs.compression import compression_of


class Form(NamedTuple):
    """A form of log, and the module that reads it, which is imported when such a log is met.

    The module has `read`, as logs.load.Reader says; for a text without `magic` also `recognises`.
    """

    name: str
    module: str
    magic: bytes | None = None
    """The first bytes of such a file; None: the module is asked."""
    container: bool = False
    """Whether it holds messages, and may be one of several files of a recording: the module then has
    `recording`, as logs.load.Container says, in place of `read`."""
    by_path: bool = False
    """Whether the module has `recording_at` too, as logs.load.Database says, which opens the file itself."""

    def fits(self, data: FileBytes) -> bool:
        """Whether these bytes are of this form."""
        if self.magic is not None:
            return data[: len(self.magic)] == self.magic
        recognised: bool = self.reader().recognises(data)
        return recognised

    def reader(self) -> Any:
        """The module."""
        return importlib.import_module(self.module)


FORMS: tuple[Form, ...] = (
    Form("MCAP", "nscan_cli.logs.recordings.mcap", b"\x89MCAP0\r\n", container=True),
    Form("ROS 1 bag", "nscan_cli.logs.recordings.rosbag1", b"#ROSBAG V2.0\n", container=True),
    Form(
        "ROS 2 bag", "nscan_cli.logs.recordings.rosbag2", b"SQLite format 3\0", container=True, by_path=True
    ),
    Form("CARMEN text", "nscan_cli.logs.text.carmen"),
    Form("Player text", "nscan_cli.logs.text.player"),
    Form(".script text", "nscan_cli.logs.text.script"),
)
"""In order of trial. A new form of log is a module and a line here."""


def readable_forms() -> str:
    """The forms that are read, as messages name them."""
    return f"{', '.join(form.name for form in FORMS)}; plain or packed by gzip, bzip2, xz, zstd or lz4"


class ForeignKind(NamedTuple):
    """What a file is that no log is read from."""

    name: str
    """As the end of the sentence "the file is …"."""
    remedy: str = ""
    """What makes a log of it, where something does."""


RENEW = "write it anew by ROS 1's `rosbag filter OLD.bag NEW.bag True`, and give the new one"
UNPACK = "take the log out of it first"
FOREIGN_MAGIC = (
    (b"#ROSBAG V", ForeignKind("a ROS 1 bag of an old version", RENEW)),
    (b"#ROSRECORD V", ForeignKind("a ROS 1 bag of an old version", RENEW)),
    (b"#ROSLOG V", ForeignKind("a ROS 1 bag of an old version", RENEW)),
    (
        b"version https://git-lfs.github.com/spec/",
        ForeignKind("a pointer of Git LFS, not the file that it stands for", "fetch that by `git lfs pull`"),
    ),
    (
        b"\x37\x7f\x06\x82",
        ForeignKind("the write-ahead log of an SQLite database", "give the .db3 that it is of"),
    ),
    (
        b"\x37\x7f\x06\x83",
        ForeignKind("the write-ahead log of an SQLite database", "give the .db3 that it is of"),
    ),
    (
        b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7",
        ForeignKind("the journal of an SQLite database", "give the .db3 that it is of"),
    ),
    (
        b"\xd4\xc3\xb2\xa1",
        ForeignKind("a capture of network packets (pcap)", "give a recording of laser scans"),
    ),
    (
        b"\xa1\xb2\xc3\xd4",
        ForeignKind("a capture of network packets (pcap)", "give a recording of laser scans"),
    ),
    (
        b"\x0a\x0d\x0d\x0a",
        ForeignKind("a capture of network packets (pcapng)", "give a recording of laser scans"),
    ),
    (b"\x89PNG\r\n\x1a\n", ForeignKind("a PNG picture")),
    (b"\xff\xd8\xff", ForeignKind("a JPEG picture")),
    (b"P5", ForeignKind("a PGM picture")),
    (b"%PDF", ForeignKind("a PDF document")),
    (b"# .PCD v", ForeignKind("a point cloud (PCD)")),
    (b"PK\x03\x04", ForeignKind("a ZIP archive", f"{UNPACK}, by `unzip`")),
    (b"7z\xbc\xaf\x27\x1c", ForeignKind("a 7z archive", f"{UNPACK}, by `7z x`")),
    (b"Rar!\x1a\x07", ForeignKind("a RAR archive", f"{UNPACK}, by `unrar x`")),
    (b"\x1f\x9d", ForeignKind("compressed by compress", "unpack it first, by `uncompress`")),
    (b"LZIP", ForeignKind("compressed by lzip", "unpack it first, by `lzip -d`")),
    (
        b"rosbag2_bagfile_information:",
        ForeignKind("the metadata of a ROS 2 bag", "give the folder that it is in"),
    ),
    (b"\x7fELF", ForeignKind("a program")),
)
"""What the first bytes say."""

FOREIGN_FIRST_LINES = (
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


RAWLOG = re.compile(
    rb"[\x00-\xff]{1,4}(mrpt::(\w+::)?)?C(Observation|Action|SensoryFrame|Rawlog)\w*[\x00-\x1f]"
)
"""How MRPT begins an object: the length of its class's name, the name, and a version."""


def foreign_kind(data: bytes) -> ForeignKind:
    """What `data` is; "of an unknown kind" when in doubt."""
    for magic, found in FOREIGN_MAGIC:
        if data.startswith(magic):
            return found
    packing = compression_of(data)
    if packing is not None:
        return ForeignKind(f"compressed by {packing.name} twice", f"unpack it once, by `{packing.command}`")
    if data[257:262] == b"ustar":
        return ForeignKind("a tar archive", f"{UNPACK}, by `tar -x`")
    if RAWLOG.match(data):
        return ForeignKind("an MRPT .rawlog", "make a ROS bag or a CARMEN log of it first")
    if b"\0" in data[:4096]:
        return ForeignKind("binary data of an unknown kind")
    line = FIRST_LINE.search(data, 0, 1 << 16)
    for pattern, name in FOREIGN_FIRST_LINES:
        if line and re.match(pattern, line.group(1)):
            return ForeignKind(name)
    return ForeignKind("of an unknown kind")


def foreign_kind_name(data: bytes) -> str:
    """The name of what `data` is, as in `foreign_kind`."""
    return foreign_kind(data).name
