"""A log by its path: the bytes, unpacked, and the reader that knows their form."""

from __future__ import annotations

import gzip
import hashlib
import io
import zlib
from dataclasses import replace
from typing import Protocol

from nscan_cli.errors import InputDataError
from nscan_cli.inputs import base_name, in_pieces, label, read_bytes
from nscan_cli.limits import INPUT, ExceededError
from nscan_cli.logs.kinds import FORMS, name_of, readable
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.scan import LaserLog, Source
from nscan_cli.text_encoding import plain


class Reader(Protocol):
    """What a module that reads a form of log has."""

    def read(self, data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
        """The scans; `file` is what messages call it. Raises InputDataError and WrongUsageError."""


AS_FOUND = ReadingOptions()

GZIP = b"\x1f\x8b"
PIECE = 256
UNPACKS = "unpacks to more and more"
MEND = "fetch the file again, or use what can be read with --salvage"


def read_log(path: str, options: ReadingOptions = AS_FOUND, even_unusable: bool = False) -> LaserLog:
    """The log at `path` ("-": standard input); its kind is found from its content.

    Raises InputMissingError when there is nothing to read, InputDataError when it is no log, a damaged one,
    or one none of whose readings counts (but with `even_unusable`), WrongUsageError when the options do
    not fit it.
    """
    return log_from(read_bytes(path), path, options, even_unusable)


def log_from(
    stored: bytes, path: str, options: ReadingOptions = AS_FOUND, even_unusable: bool = False
) -> LaserLog:
    """The log in the bytes that `path` has; raises the same errors."""
    name = label(path)
    source = Source(base_name(path), hashlib.sha256(stored).hexdigest(), len(stored))
    data, lost = content_of(stored, path, options.salvage)
    del stored
    if not data.strip():
        raise InputDataError(name, "is empty", "give a log with laser scans")
    try:
        log = _reader(data, name).read(data, name, source, options)
    except ExceededError as error:
        raise InputDataError(name, str(error), error.remedy) from error
    if log.report.unusable is not None and not even_unusable:
        raise log.report.unusable
    if lost is None:
        return log
    report = replace(log.report, warnings=(lost, *log.report.warnings))
    return replace(log, report=report)


def content_of(stored: bytes, path: str, salvage: bool) -> tuple[bytes, str | None]:
    """What the bytes of `path` hold when they are unpacked, and what was lost when that was allowed.

    Raises InputDataError.
    """
    try:
        content, lost = salvaged(stored) if salvage else (unpacked(stored, label(path)), None)
    except ExceededError as error:
        raise InputDataError(label(path), str(error), error.remedy) from error
    return plain(content, label(path)), lost


def _reader(data: bytes, name: str) -> Reader:
    for form in FORMS:
        if form.fits(data):
            reader: Reader = form.reader()
            return reader
    raise InputDataError(name, f"is {name_of(data)}", f"give a log: {readable()}")


def unpacked(stored: bytes, name: str) -> bytes:
    """The content of `stored`, which may be compressed by gzip. Raises InputDataError and ExceededError."""
    if not stored.startswith(GZIP):
        return stored
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(stored)) as file:
            return in_pieces(file.read, INPUT, UNPACKS)
    except EOFError as error:
        raise InputDataError(name, "the gzip data end too early", MEND) from error
    except (zlib.error, OSError) as error:
        raise InputDataError(name, f"the gzip data are damaged ({error})", MEND) from error


def salvaged(stored: bytes) -> tuple[bytes, str | None]:
    """The content of `stored` as far as it can be unpacked, and what was lost; None when nothing was.

    Raises ExceededError.
    """
    if not stored.startswith(GZIP):
        return stored, None
    content, at, most = bytearray(), 0, INPUT.bytes
    while stored.startswith(GZIP, at):
        member = zlib.decompressobj(zlib.MAX_WBITS | 16)
        try:
            # In pieces: what goes before the damage stays.
            while at < len(stored) and not member.eof:
                content += member.decompress(stored[at : at + PIECE])
                at = min(at + PIECE, len(stored)) - len(member.unused_data)
                if len(content) > most:
                    raise ExceededError(INPUT, UNPACKS)
        except zlib.error as error:
            return bytes(content), f"the gzip data are damaged near byte {at} ({error}): the rest is lost"
        if not member.eof:
            return bytes(content), "the gzip data end too early: the rest is lost"
        while stored.startswith(b"\0", at):
            at += 1
    if at < len(stored):
        return bytes(content), f"{len(stored) - at} bytes after the gzip data are no such data: left out"
    return bytes(content), None
