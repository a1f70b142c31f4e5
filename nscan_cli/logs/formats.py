"""The forms of log that are read, recognised by their content, and names for other files."""

from __future__ import annotations

import importlib
import re
from typing import Any, NamedTuple

from nscan_cli.files.inputs import FileBytes
from nscan_cli.logs.compression import compression_of


class Form(NamedTuple):
    """A form of log and the module that reads it, which is imported when such a log is met.

    The module has `recognises(data)` if the form has no `magic`, and `read(data, file, source, options)`. It
    returns a LaserLog, and raises InputDataError and WrongUsageError; `file` is the name for messages.
    """

    name: str
    module: str
    magic: bytes | None = None
    """The first bytes of such a file; None if the module recognises it."""
    container: bool = False
    """Whether a file holds messages and may be one of several files of a recording. The module then has
    `read_recording(data, file, salvage)` instead of `read`, which returns a Recording, and also raises
    LimitExceededError."""
    by_path: bool = False
    """Whether the module also has `read_recording_file(path, journals, file, salvage)`, for a file that is
    not in memory, and its journals (log_files.journals_of)."""

    def fits(self, data: FileBytes) -> bool:
        """Whether the bytes of a file are of this form."""
        if self.magic is not None:
            return data[: len(self.magic)] == self.magic
        recognised: bool = self.reader().recognises(data)
        return recognised

    def reader(self) -> Any:
        """The module, imported."""
        return importlib.import_module(self.module)


FORMS: tuple[Form, ...] = (
    Form("MCAP", "nscan_cli.logs.recordings.mcap", b"\x89MCAP0\r\n", container=True),
    Form("ROS 1 bag", "nscan_cli.logs.recordings.rosbag1", b"#ROSBAG V2.0\n", container=True),
    Form(
        "ROS 2 bag", "nscan_cli.logs.recordings.rosbag2", b"SQLite format 3\0", container=True, by_path=True
    ),
    Form("CARMEN text", "nscan_cli.logs.text.carmen"),
    Form("Player text", "nscan_cli.logs.text.player"),
    Form(".script text", "nscan_cli.logs.text.script_format"),
)
"""The forms in the order in which they are tried. A new form of log is a module and a line here."""


def readable_forms() -> str:
    """The forms that are read, as text for messages."""
    return f"{', '.join(form.name for form in FORMS)}; plain or packed by gzip, bzip2, xz, zstd or lz4"


class ForeignKind(NamedTuple):
    """A kind of file that is no log."""

    name: str
    """Ends the sentence "the file is …"."""
    remedy: str = ""
    """How to get a log from it, if there is a way."""


EXTRACT = "take the log out of it first"
FILTER_BAG = "convert it by ROS 1's `rosbag filter OLD.bag NEW.bag True`, and give the new one"
GIVE_DATABASE = "give the .db3 that it belongs to"
GIVE_RECORDING = "give a recording of laser scans"
FOREIGN_MAGIC = (
    ("a ROS 1 bag of an old version", FILTER_BAG, (b"#ROSBAG V", b"#ROSRECORD V", b"#ROSLOG V")),
    (
        "a Git LFS pointer, not the file itself", "fetch the file by `git lfs pull`",
        (b"version https://git-lfs.github.com/spec/",),
    ),
    (
        "the write-ahead log of an SQLite database", GIVE_DATABASE,
        (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83"),
    ),
    ("the journal of an SQLite database", GIVE_DATABASE, (b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7",)),
    (
        "a capture of network packets (pcap)", GIVE_RECORDING,
        (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4"),
    ),
    ("a capture of network packets (pcapng)", GIVE_RECORDING, (b"\x0a\x0d\x0d\x0a",)),
    ("a PNG picture", "", (b"\x89PNG\r\n\x1a\n",)),
    ("a JPEG picture", "", (b"\xff\xd8\xff",)),
    ("a PGM picture", "", (b"P5",)),
    ("a PDF document", "", (b"%PDF",)),
    ("a point cloud (PCD)", "", (b"# .PCD v",)),
    ("a ZIP archive", f"{EXTRACT}, by `unzip`", (b"PK\x03\x04",)),
    ("a 7z archive", f"{EXTRACT}, by `7z x`", (b"7z\xbc\xaf\x27\x1c",)),
    ("a RAR archive", f"{EXTRACT}, by `unrar x`", (b"Rar!\x1a\x07",)),
    ("compressed by compress", "decompress it first, by `uncompress`", (b"\x1f\x9d",)),
    ("compressed by lzip", "decompress it first, by `lzip -d`", (b"LZIP",)),
    ("the metadata of a ROS 2 bag", "give the folder that it is in", (b"rosbag2_bagfile_information:",)),
    ("a program", "", (b"\x7fELF",)),
)  # fmt: skip
"""Name, remedy and first bytes of kinds of files."""

FOREIGN_FIRST_LINES = (
    (rb"\[{1,2}[\w.-]+\]{1,2}\s*$", "TOML or INI text"),
    (rb'\{"format": ?"nscan-pose-graph"', "a pose graph (JSON)"),
    (rb"[{\[]", "JSON text"),
    (rb"<", "HTML or XML text"),
    (rb"(VERTEX_SE2|EDGE_SE2|VERTEX2|EDGE2|VERTEX_SE3:QUAT|EDGE_SE3:QUAT)\s", "a pose graph (g2o or TORO)"),
    (rb"(LASER_READING|GFS_\w+)\s", "a GMapping .gfs file"),
    (rb"(@SENS|@OPEN|#ROBOT|#LASER)\s", "a BeeSoft .rec log"),
    (rb"(image|resolution):", "a map's YAML file"),
    (rb"([-+.\deE]+[ \t]+){7}[-+.\deE]+\s*$", "a list of eight numbers per line, such as poses or relations"),
)
"""Kinds of texts by the first line that is neither blank nor a comment."""

FIRST_LINE = re.compile(rb"^[ \t]*([^\s#][^\r\n]*)", re.MULTILINE)
RAWLOG = re.compile(
    rb"[\x00-\xff]{1,4}(mrpt::(\w+::)?)?C(Observation|Action|SensoryFrame|Rawlog)\w*[\x00-\x1f]"
)
"""The beginning of an object of MRPT: the length of its class name, the name, and a version."""


def foreign_kind(data: bytes) -> ForeignKind:
    """The kind of a file that is no log, by its content."""
    for name, remedy, magics in FOREIGN_MAGIC:
        if data.startswith(magics):
            return ForeignKind(name, remedy)
    packing = compression_of(data)
    if packing is not None:
        return ForeignKind(
            f"compressed by {packing.name} twice", f"decompress it once, by `{packing.command}`"
        )
    if data[257:262] == b"ustar":
        return ForeignKind("a tar archive", f"{EXTRACT}, by `tar -x`")
    if RAWLOG.match(data):
        return ForeignKind("an MRPT .rawlog", "convert it to a ROS bag or a CARMEN log first")
    if b"\0" in data[:4096]:
        return ForeignKind("binary data of an unknown kind")
    line = FIRST_LINE.search(data, 0, 1 << 16)
    for pattern, name in FOREIGN_FIRST_LINES:
        if line and re.match(pattern, line.group(1)):
            return ForeignKind(name)
    return ForeignKind("of an unknown kind")
