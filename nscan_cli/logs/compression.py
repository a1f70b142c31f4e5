"""Files that are compressed as a whole: recognise the compression and decompress piece by piece."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from nscan_cli.files.inputs import FileBytes
from nscan_cli.files.limits import INPUT, LimitExceededError

PIECE_BYTES = 256
"""Bytes decompressed at once. A larger value loses more data before damage and needs more memory."""
KEEPS_GROWING = "decompresses to too many bytes"


class Compression(NamedTuple):
    """A kind of compression."""

    name: str
    magic: bytes
    """The first bytes of such a file."""
    new: Callable[[], Any]
    """Imports the library, and makes a decompressor with the standard library's decompress(bytes), eof and
    unused_data."""
    command: str
    """The command that decompresses such a file."""


GZIP = Compression("gzip", b"\x1f\x8b", lambda: zlib.decompressobj(zlib.MAX_WBITS | 16), "gunzip")
BZIP2 = Compression("bzip2", b"BZh", lambda: import_module("bz2").BZ2Decompressor(), "bunzip2")
XZ = Compression(
    "xz", b"\xfd7zXZ\0", lambda: import_module("lzma").LZMADecompressor(memlimit=INPUT.bytes), "unxz"
)
ZSTD = Compression(
    "zstd",
    b"\x28\xb5\x2f\xfd",
    lambda: import_module("zstandard").ZstdDecompressor().decompressobj(),
    "unzstd",
)
LZ4 = Compression(
    "lz4", b"\x04\x22\x4d\x18", lambda: import_module("lz4.frame").LZ4FrameDecompressor(), "unlz4"
)
COMPRESSIONS = (GZIP, BZIP2, XZ, ZSTD, LZ4)
SUFFIXES = (".gz", ".bz2", ".xz", ".zst", ".zstd", ".lz4")
"""Suffixes of the names of compressed files."""


def compression_of(data: FileBytes) -> Compression | None:
    """The compression of the data; None if there is none."""
    return next((packing for packing in COMPRESSIONS if data[: len(packing.magic)] == packing.magic), None)


def decompressed(stored: bytes, packing: Compression) -> tuple[bytes, str | None]:
    """The content as far as it can be decompressed, and the problem with the rest or None.

    Several compressed streams may follow one another. Raises LimitExceededError if the content is too large.
    """
    content: list[bytes] = []
    size, at, most = 0, 0, INPUT.bytes
    problem = None
    while problem is None and stored.startswith(packing.magic, at):
        try:
            member = packing.new()
            while at < len(stored) and not member.eof:
                piece = member.decompress(stored[at : at + PIECE_BYTES])
                at = min(at + PIECE_BYTES, len(stored)) - len(member.unused_data or b"")
                content.append(piece)
                size += len(piece)
                if size > most:
                    raise LimitExceededError(INPUT, KEEPS_GROWING)
        except LimitExceededError:
            raise
        except Exception as error:
            # zlib.error, OSError, LZMAError, ZstdError, RuntimeError: each library has its own.
            problem = f"are damaged near byte {at} ({' '.join(str(error).split())})"
        else:
            problem = None if member.eof else "end too early"
        while stored.startswith(b"\0", at):
            at += 1
    if problem is not None:
        return b"".join(content), f"the {packing.name} data {problem}"
    if at < len(stored):
        left = len(stored) - at
        return b"".join(content), f"{left} bytes after the {packing.name} data are something else"
    return b"".join(content), None
