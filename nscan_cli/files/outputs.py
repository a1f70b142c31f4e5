"""Where results go: whole files or none, standard output for data, standard error for people."""

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
"""What the name of a file begins with that is not whole yet; a process that is killed leaves it behind."""


@contextlib.contextmanager
def atomic_file(path: str) -> Iterator[BinaryIO]:
    """A binary file that appears under `path` whole when the block ends well, and not at all otherwise.

    "-" is standard output; what is no regular file, such as /dev/null or a named pipe, is written to as
    it is. What killed processes have left in the folder is cleared away. Raises OutputError when the
    folder is missing or nothing can be written.
    """
    if path == "-":
        if sys.stdout is None:
            raise OutputError("standard output: is closed; name a file with -o")
        yield sys.stdout.buffer
        sys.stdout.buffer.flush()
        return
    check_writable(path)
    # A symbolic link stays what it is: the file that it names is replaced.
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
    """A new file in the folder, and its name; gone when the block ends, unless it was renamed.

    It is locked as long as it is open: by that, others see that somebody is at work on it.
    """
    while True:
        # A name that nobody can guess, and the rights of any other new file: the umask applies.
        name = str(folder / f"{TEMPORARY_PREFIX}{os.urandom(8).hex()}")
        descriptor = os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o666)
        with os.fdopen(descriptor, "wb") as file:
            try:
                # Before it is locked, another process may take it for left over.
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
    """Remove the files that killed processes have begun to write in the folder."""
    with contextlib.suppress(OSError):
        for left_over in folder.glob(f"{TEMPORARY_PREFIX}*"):
            with contextlib.suppress(OSError), left_over.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                left_over.unlink()


def check_writable(path: str | None) -> None:
    """Refuse an output that can never be written, before the work that it takes is done.

    Raises OutputError.
    """
    if path is None or path == "-":
        return
    # os.path asks in a way that a name too long for the file system is no error yet.
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
    """Whether there is something under `path` that is neither a file nor a folder."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def write_atomically(path: str, data: bytes) -> None:
    """Write `data` to `path` ("-": standard output), whole or not at all. Raises OutputError."""
    with atomic_file(path) as file:
        file.write(data)


def write_once(path: Path, data: bytes) -> None:
    """Write `data` whole to a file that nobody has written before; what is there stays. Raises OSError."""
    remove_leftovers(path.parent)
    with _temporary(path.parent) as (file, name):
        file.write(data)
        file.flush()
        try:
            os.link(name, path)
        except FileExistsError:
            pass
        except OSError:
            # Some file systems know one name for a file only.
            os.replace(name, path)
