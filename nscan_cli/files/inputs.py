"""Reading the bytes of an input: a file or standard input, with errors that name a remedy."""

from __future__ import annotations

import contextlib
import hashlib
import mmap
import os
import stat
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.files.encoding import without_byte_order_mark
from nscan_cli.files.limits import CONFIG, INPUT, MB, Limit, LimitExceededError
from nscan_cli.files.text import name_of_path

STANDARD_INPUT = "-"
"""The path that stands for standard input."""
FileBytes = bytes | mmap.mmap
"""The bytes of a file, in memory or memory-mapped."""


def read_bytes(path: str, limit: Limit = INPUT) -> bytes:
    """Read all bytes of the file `path`, or of standard input if it is "-".

    Raises InputMissingError if the file is missing or cannot be read, and InputDataError if it is larger than
    the limit.
    """
    with limits_as_input_errors(label(path)), _as_input_errors(path):
        if path == STANDARD_INPUT:
            return read_all(sys.stdin.buffer.read, limit)
        with open(path, "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                return read_all(file.read, limit)
            limit.check(status.st_size / MB, f"has {status.st_size / MB:,.0f} MB")
            return file.read()


def memory_map(path: str) -> mmap.mmap:
    """Map a regular file into memory; bytes are read when they are used. Raises InputMissingError."""
    with _as_input_errors(path), open(path, "rb") as file:
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


def sha256_of(path: str) -> str:
    """The SHA-256 of a regular file, read in blocks. Raises InputMissingError."""
    with _as_input_errors(path), open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextlib.contextmanager
def limits_as_input_errors(file: str) -> Iterator[None]:
    """Turn a LimitExceededError into an InputDataError that names the file."""
    try:
        yield
    except LimitExceededError as error:
        raise InputDataError(file, str(error), error.remedy) from error


@contextlib.contextmanager
def _as_input_errors(path: str) -> Iterator[None]:
    """Turn errors of reading a file into InputMissingError."""
    try:
        yield
    except FileNotFoundError as error:
        raise InputMissingError(f"{path}: no such file; check the path") from error
    except IsADirectoryError as error:
        raise InputMissingError(f"{path}: is a folder; name a file in it") from error
    except PermissionError as error:
        raise InputMissingError(f"{path}: may not be read; change its permissions") from error
    except (OSError, ValueError) as error:
        raise InputMissingError(f"{path!r}: cannot be read: {error}; check the path") from error


def read_text(path: str, limit: Limit = INPUT) -> bytes:
    """Read a text without byte-order mark. Also raises InputDataError if it is in UTF-16 or UTF-32."""
    return without_byte_order_mark(read_bytes(path, limit), label(path))


def read_all(read: Callable[[int], bytes], limit: Limit) -> bytes:
    """Read a stream of unknown length. Raises LimitExceededError if it is longer than the limit."""
    pieces, size, most = [], 0, limit.bytes
    while piece := read(MB):
        size += len(piece)
        if size > most:
            raise LimitExceededError(limit, "goes on and on")
        pieces.append(piece)
    return b"".join(pieces)


def read_toml(path: str, remedy: str) -> dict[str, Any]:
    """Read a TOML file. Raises InputMissingError, and InputDataError if it is not valid TOML."""
    try:
        return tomllib.loads(read_text(path, CONFIG).decode())
    except (ValueError, RecursionError) as error:
        # Besides TOMLDecodeError: bytes that are not UTF-8, a number of thousands of digits.
        raise InputDataError(label(path), f"not TOML: {error}", remedy) from error


def common_hash(hashes: Iterable[str]) -> str:
    """One SHA-256 for several files: that of their sorted hexadecimal digests."""
    return hashlib.sha256("".join(sorted(hashes)).encode()).hexdigest()


def label(path: str) -> str:
    """The name of an input in messages: the path as the user gave it."""
    return "standard input" if path == STANDARD_INPUT else path


def base_name(path: str) -> str:
    """The name of an input in results: without its folder, so that it is the same on every machine."""
    return "standard input" if path == STANDARD_INPUT else name_of_path(path)
