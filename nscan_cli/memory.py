"""Memory that was freed is used again, or goes back to the system."""

from __future__ import annotations

import contextlib
import ctypes
import gc

M_ARENA_MAX = -8
"""The name of mallopt's parameter in glibc: M_ARENA_MAX."""


def use_one_arena() -> None:
    """Let all threads that are begun from now on take memory from one heap, where that can be chosen (glibc).

    Each has its own else, and what one of them has freed the others cannot use.
    """
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(ctypes.c_int(M_ARENA_MAX), ctypes.c_int(1))


def release_memory() -> None:
    """Let the allocator return what it keeps for later, where it can be asked to (glibc).

    After millions of small arrays that are gone, the room between those that are left is in pieces that
    large ones do not fit into.
    """
    gc.collect()
    trim_heap()


def trim_heap() -> None:
    """The same for what is known to be free, which takes no time."""
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(ctypes.c_size_t(0))
