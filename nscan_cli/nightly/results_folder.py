"""The folder of the nights: one caller at a time, and a place for what is only needed meanwhile."""

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
    """The folder, made where only its parent is there, and nobody else's until the block ends.

    However the holder ends, its claim ends with it; what a killed one has begun to write is cleared away.
    Raises OutputError.
    """
    path = Path(folder)
    try:
        path.mkdir(exist_ok=True)
        lock = os.open(path / LOCK, os.O_CREAT | os.O_RDWR, 0o666)
    except FileNotFoundError as error:
        raise OutputError(f"{folder}: the folder {path.parent} does not exist; create it first") from error
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(f"{folder}: is no folder; name one, or a new one") from error
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written to: {error.strerror}; choose another") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock)
        raise OutputError(f"{folder}: another nightly is at work there; wait for it") from error
    try:
        for left_over in (*path.glob(f"{TEMPORARY_PREFIX}*"), *path.glob(f"*/{TEMPORARY_PREFIX}*")):
            left_over.unlink()
        yield path
    finally:
        os.close(lock)


@contextlib.contextmanager
def scratch_folder(folder: Path) -> Iterator[Path]:
    """An empty folder in `folder`, gone when the block ends, or at the next call when it was cut off."""
    place = folder / SCRATCH
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(exist_ok=True)
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)


def log_folder(folder: Path, name: str) -> Path:
    """The folder of one log's results, made where it is missing. Raises OutputError."""
    try:
        (folder / name).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder / name}: cannot be made: {error.strerror}; clear it away") from error
    return folder / name
