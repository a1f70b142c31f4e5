"""A log by its path: the bytes, unpacked, and the reader that knows their form."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from typing import Protocol

from nscan_cli.errors import InputDataError
from nscan_cli.inputs import base_name, label, read_bytes
from nscan_cli.logs import carmen
from nscan_cli.logs.kinds import name_of
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.scan import LaserLog, Source


class Reader(Protocol):
    """What a module that reads a form of log has."""

    def recognises(self, data: bytes) -> bool:
        """Whether these bytes are of its form."""

    def read(self, data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
        """The scans; `file` is what messages call it. Raises InputDataError and WrongUsageError."""


READERS: tuple[Reader, ...] = (carmen,)
"""In order of trial."""
AS_FOUND = ReadingOptions()

GZIP = b"\x1f\x8b"


def read_log(path: str, options: ReadingOptions = AS_FOUND) -> LaserLog:
    """The log at `path` ("-": standard input); its kind is found from its content.

    Raises InputMissingError when there is nothing to read, InputDataError when it is no log or a damaged
    one, WrongUsageError when the options do not fit it.
    """
    stored = read_bytes(path)
    name = label(path)
    source = Source(base_name(path), hashlib.sha256(stored).hexdigest(), len(stored))
    data = unpacked(stored, name)
    del stored
    if not data.strip():
        raise InputDataError(name, "is empty", "give a log with laser scans")
    for reader in READERS:
        if reader.recognises(data):
            return reader.read(data, name, source, options)
    raise InputDataError(name, f"is {name_of(data)}", "give a CARMEN log, plain or compressed by gzip")


def unpacked(stored: bytes, name: str) -> bytes:
    """The content of `stored`, which may be compressed by gzip. Raises InputDataError."""
    if not stored.startswith(GZIP):
        return stored
    try:
        return gzip.decompress(stored)
    except EOFError as error:
        raise InputDataError(name, "the gzip data end too early", "fetch the file again") from error
    except (zlib.error, OSError) as error:
        raise InputDataError(name, f"the gzip data are damaged ({error})", "fetch the file again") from error
