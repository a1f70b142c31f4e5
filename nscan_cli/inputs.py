"""The bytes of an input: a path or standard input, and an error with a remedy when there are none."""

from __future__ import annotations

import sys
from pathlib import Path

from nscan_cli.errors import InputMissingError

STANDARD_INPUT = "-"


def read_bytes(path: str) -> bytes:
    """All bytes of the file `path`, or of standard input when it is "-".

    Raises InputMissingError when there is no such file, or it cannot be read.
    """
    if path == STANDARD_INPUT:
        return sys.stdin.buffer.read()
    try:
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputMissingError(f"{path}: no such file; check the path") from error
    except IsADirectoryError as error:
        raise InputMissingError(f"{path}: is a folder; name a file in it") from error
    except PermissionError as error:
        raise InputMissingError(f"{path}: may not be read; change its permissions") from error
    except (OSError, ValueError) as error:
        raise InputMissingError(f"{path!r}: cannot be read: {error}; check the path") from error


def label(path: str) -> str:
    """An input as messages call it: the path that the user gave."""
    return "standard input" if path == STANDARD_INPUT else path


def base_name(path: str) -> str:
    """An input as results call it: its name without its folder, the same on every machine."""
    return "standard input" if path == STANDARD_INPUT else Path(path).name
