"""The results folder: its lock, its scratch folder, and the folders of the logs."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from nscan_cli.errors import OutputError
from nscan_cli.files.outputs import TEMPORARY_PREFIX

LOCK, SCRATCH = ".lock", ".scratch"


@contextlib.contextmanager
def locked_folder(folder: str) -> Iterator[Path]:
    """Lock the folder until the block ends; it is made if its parent exists. Raises OutputError.

    The lock ends with the process, however that ends. Half-written files of a killed one are removed.
    """
    path = Path(folder)
    try:
        path.mkdir(exist_ok=True)
        lock = os.open(path / LOCK, os.O_CREAT | os.O_RDWR, 0o666)
    except FileNotFoundError as error:
        raise OutputError(f"{folder}: the folder {path.parent} does not exist; create it first") from error
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(f"{folder}: is not a folder; name another") from error
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written to: {error.strerror}; choose another") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock)
        raise OutputError(f"{folder}: another nightly is running there; wait for it") from error
    try:
        for left_over in (*path.glob(f"{TEMPORARY_PREFIX}*"), *path.glob(f"*/{TEMPORARY_PREFIX}*")):
            left_over.unlink()
        yield path
    finally:
        os.close(lock)


@contextlib.contextmanager
def scratch_folder(folder: Path) -> Iterator[Path]:
    """An empty folder in `folder`, removed when the block ends, or by the next call if this one is killed."""
    place = folder / SCRATCH
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(exist_ok=True)
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)


def log_folder(folder: Path, name: str) -> Path:
    """The folder of one log's results, made if it is missing. Raises OutputError."""
    try:
        (folder / name).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{folder / name}: cannot be made: {error.strerror}; remove what is there"
        ) from error
    return folder / name
