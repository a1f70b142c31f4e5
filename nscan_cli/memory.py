"""Control of glibc's allocator, so that freed memory is reused or returned to the system."""

from __future__ import annotations

import contextlib
import ctypes
import gc

M_ARENA_MAX = -8
"""The parameter M_ARENA_MAX of mallopt in glibc."""


def use_one_arena() -> None:
    """Let all threads that start from now on allocate from one arena (glibc).

    By default each thread has its own, and cannot reuse what another thread has freed.
    """
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(ctypes.c_int(M_ARENA_MAX), ctypes.c_int(1))


def release_memory() -> None:
    """Collect garbage, and return free memory to the system (glibc).

    After millions of small arrays, free memory is fragmented, and large arrays do not fit into it.
    """
    gc.collect()
    trim_heap()


def trim_heap() -> None:
    """Return free memory to the system without a garbage collection (glibc). This takes no time."""
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(ctypes.c_size_t(0))
