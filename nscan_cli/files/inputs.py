"""The bytes of an input: a path or standard input, and an error with a remedy when there are none."""

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
FileBytes = bytes | mmap.mmap
"""Those of a file: in memory, or where they are."""


def read_bytes(path: str, limit: Limit = INPUT) -> bytes:
    """All bytes of the file `path`, or of standard input when it is "-".

    Raises InputMissingError when there is no such file, or it cannot be read; InputDataError when there
    are more than the limit allows.
    """
    try:
        with _as_input_errors(path):
            if path == STANDARD_INPUT:
                return read_all(sys.stdin.buffer.read, limit)
            with open(path, "rb") as file:
                status = os.fstat(file.fileno())
                if not stat.S_ISREG(status.st_mode):
                    return read_all(file.read, limit)
                limit.check(status.st_size / MB, f"has {status.st_size / MB:,.0f} MB")
                return file.read()
    except LimitExceededError as error:
        raise InputDataError(label(path), str(error), error.remedy) from error


def memory_map(path: str) -> mmap.mmap:
    """The bytes of a regular file, which stay where they are until they are looked at.

    Raises InputMissingError as read_bytes does.
    """
    with _as_input_errors(path), open(path, "rb") as file:
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


def sha256_of(path: str) -> str:
    """The SHA-256 of a regular file, which is never in memory as a whole. Raises InputMissingError."""
    with _as_input_errors(path), open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextlib.contextmanager
def _as_input_errors(path: str) -> Iterator[None]:
    """What goes wrong when a file is read, as InputMissingError."""
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
    """The bytes of a text without a byte-order mark; raises also InputDataError for one that is not UTF-8."""
    return without_byte_order_mark(read_bytes(path, limit), label(path))


def read_all(read: Callable[[int], bytes], limit: Limit, problem: str = "goes on and on") -> bytes:
    """All that can be read from where nobody knows the length. Raises ExceededError beyond the limit."""
    pieces, size, most = [], 0, limit.bytes
    while piece := read(MB):
        size += len(piece)
        if size > most:
            raise LimitExceededError(limit, problem)
        pieces.append(piece)
    return b"".join(pieces)


def read_toml(path: str, remedy: str) -> dict[str, Any]:
    """The tables of a TOML file. Raises InputMissingError, and InputDataError when it is no TOML."""
    try:
        return tomllib.loads(read_text(path, CONFIG).decode())
    except (ValueError, RecursionError) as error:
        # Not only TOML's own error: bytes that are no text, a number of thousands of digits.
        raise InputDataError(label(path), f"not TOML: {error}", remedy) from error


def common_hash(hashes: Iterable[str]) -> str:
    """The SHA-256 of several files together: that of theirs (hexadecimal digits), in whatever order."""
    return hashlib.sha256("".join(sorted(hashes)).encode()).hexdigest()


def label(path: str) -> str:
    """An input as messages call it: the path that the user gave."""
    return "standard input" if path == STANDARD_INPUT else path


def base_name(path: str) -> str:
    """An input as results call it: its name without its folder, the same on every machine."""
    return "standard input" if path == STANDARD_INPUT else name_of_path(path)
