"""Processes that need the same kernel at the same time: one compiles it, and the others wait for its code."""

from __future__ import annotations

import contextlib
import fcntl
import time
from collections.abc import Iterator
from pathlib import Path

LOCK_SUFFIX = ".lock"
"""Suffix of the file that a process locks while it compiles the kernel of that name."""
PATIENCE = 120.0
"""Longest wait for another process, s. It may have been stopped, so this one then compiles the kernel too."""
INTERVAL = 0.02
"""Time between two looks at the lock, s."""


@contextlib.contextmanager
def compile_lock(file: Path) -> Iterator[None]:
    """Hold the lock of a kernel's file. Where there can be no locks, processes compile the same twice."""
    lock = file.with_suffix(LOCK_SUFFIX)
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):
            opened = stack.enter_context(lock.open("w"))
            latest = time.monotonic() + PATIENCE
            while not _is_locked(opened.fileno()) and time.monotonic() < latest:
                time.sleep(INTERVAL)
            stack.callback(lock.unlink, missing_ok=True)
        yield


def _is_locked(descriptor: int) -> bool:
    """Whether this process has the lock now."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def kernels_in_work(folder: Path) -> list[str]:
    """The names of the kernels that processes compile right now."""
    return sorted(path.name.split("-")[0].rpartition(".")[2] for path in folder.glob(f"*{LOCK_SUFFIX}"))
