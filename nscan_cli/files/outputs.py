"""Writing of results: atomically to files, or to standard output."""

from __future__ import annotations

import contextlib
import fcntl
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from nscan_cli.errors import OutputError

TEMPORARY_PREFIX = ".nscan-cli."
"""Prefix of the names of temporary files. A process that is killed leaves them behind."""


@contextlib.contextmanager
def atomic_file(path: str) -> Iterator[BinaryIO]:
    """A binary file that appears under `path` when the block ends without an error, and otherwise not at all.

    "-" is standard output. A device or a named pipe is written to directly. Temporary files of killed
    processes in the folder are removed. Raises OutputError if the folder is missing or cannot be written.
    """
    if path == "-":
        if sys.stdout is None:
            raise OutputError("standard output: is closed; name a file with -o")
        yield sys.stdout.buffer
        sys.stdout.buffer.flush()
        return
    check_writable(path)
    # A symbolic link is kept, and its target replaced.
    target = Path(os.path.realpath(path))
    try:
        if is_device(path):
            with open(path, "wb") as device:
                yield device
            return
        remove_leftovers(target.parent)
        with _temporary(target.parent) as (file, name):
            yield file
            file.flush()
            os.fsync(file.fileno())
            os.replace(name, target)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}; choose another") from error


@contextlib.contextmanager
def _temporary(folder: Path) -> Iterator[tuple[BinaryIO, str]]:
    """A new temporary file in the folder, and its name. It is removed at the end unless it was renamed.

    It is locked while it is open, so that other processes do not remove it as left behind.
    """
    while True:
        # The name cannot be guessed, and the umask applies as for any other new file.
        name = str(folder / f"{TEMPORARY_PREFIX}{os.urandom(8).hex()}")
        descriptor = os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o666)
        with os.fdopen(descriptor, "wb") as file:
            try:
                # Before it is locked, another process may remove it.
                with contextlib.suppress(OSError):
                    fcntl.flock(descriptor, fcntl.LOCK_EX)
                if os.fstat(descriptor).st_nlink == 0:
                    continue
                yield file, name
                return
            finally:
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(name)


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of killed processes from the folder."""
    with contextlib.suppress(OSError):
        for left_over in folder.glob(f"{TEMPORARY_PREFIX}*"):
            with contextlib.suppress(OSError), left_over.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                left_over.unlink()


def check_writable(path: str | None) -> None:
    """Raises OutputError if `path` cannot be written. Commands call it before they start to compute."""
    if path is None or path == "-":
        return
    # os.path accepts names that are too long for the file system.
    folder = os.path.dirname(os.path.realpath(path))
    if os.path.isdir(path):
        raise OutputError(f"{path}: is a folder; name a file in it")
    if is_device(path):
        if not os.access(path, os.W_OK):
            raise OutputError(f"{path}: is not writable; choose another")
        return
    if not os.path.isdir(folder):
        raise OutputError(f"{path}: the folder {Path(path).parent} does not exist; create it first")
    if not os.access(folder, os.W_OK):
        raise OutputError(f"{path}: the folder {Path(path).parent} is not writable; choose another")


def is_device(path: str) -> bool:
    """Whether `path` exists and is neither a regular file nor a folder."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def write_atomically(path: str, data: bytes) -> None:
    """Write `data` atomically to `path`; "-" is standard output. Raises OutputError."""
    with atomic_file(path) as file:
        file.write(data)


def write_once(path: Path, data: bytes) -> None:
    """Write `data` atomically to a new file; an existing file is kept. Raises OSError."""
    remove_leftovers(path.parent)
    with _temporary(path.parent) as (file, name):
        file.write(data)
        file.flush()
        try:
            os.link(name, path)
        except FileExistsError:
            pass
        except OSError:
            # Some file systems have no hard links.
            os.replace(name, path)
