"""The bytes of an input: a path or standard input, and an error with a remedy when there are none."""

from __future__ import annotations

import os
import stat
import sys
import tomllib
from collections.abc import Callable
from typing import Any

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.limits import CONFIG, INPUT, MB, ExceededError, Limit
from nscan_cli.text import name_of_path

STANDARD_INPUT = "-"


def read_bytes(path: str, limit: Limit = INPUT) -> bytes:
    """All bytes of the file `path`, or of standard input when it is "-".

    Raises InputMissingError when there is no such file, or it cannot be read; InputDataError when there
    are more than the limit allows.
    """
    try:
        if path == STANDARD_INPUT:
            return in_pieces(sys.stdin.buffer.read, limit)
        with open(path, "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                return in_pieces(file.read, limit)
            limit.check(status.st_size / MB, f"has {status.st_size / MB:,.0f} MB")
            return file.read()
    except ExceededError as error:
        raise InputDataError(label(path), str(error), error.remedy) from error
    except FileNotFoundError as error:
        raise InputMissingError(f"{path}: no such file; check the path") from error
    except IsADirectoryError as error:
        raise InputMissingError(f"{path}: is a folder; name a file in it") from error
    except PermissionError as error:
        raise InputMissingError(f"{path}: may not be read; change its permissions") from error
    except (OSError, ValueError) as error:
        raise InputMissingError(f"{path!r}: cannot be read: {error}; check the path") from error


def in_pieces(read: Callable[[int], bytes], limit: Limit, problem: str = "goes on and on") -> bytes:
    """All that can be read from where nobody knows the length. Raises ExceededError beyond the limit."""
    pieces, size, most = [], 0, limit.bytes
    while piece := read(MB):
        size += len(piece)
        if size > most:
            raise ExceededError(limit, problem)
        pieces.append(piece)
    return b"".join(pieces)


def read_toml(path: str, remedy: str) -> dict[str, Any]:
    """The tables of a TOML file. Raises InputMissingError, and InputDataError when it is no TOML."""
    try:
        return tomllib.loads(read_bytes(path, CONFIG).decode())
    except (ValueError, RecursionError) as error:
        # Not only TOML's own error: bytes that are no text, a number of thousands of digits.
        raise InputDataError(label(path), f"not TOML: {error}", remedy) from error


def label(path: str) -> str:
    """An input as messages call it: the path that the user gave."""
    return "standard input" if path == STANDARD_INPUT else path


def base_name(path: str) -> str:
    """An input as results call it: its name without its folder, the same on every machine."""
    return "standard input" if path == STANDARD_INPUT else name_of_path(path)
