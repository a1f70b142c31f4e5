"""Memory that was freed goes back to the system."""

from __future__ import annotations

import contextlib
import ctypes
import gc


def give_back() -> None:
    """Let the allocator return what it keeps for later, where it can be asked to (glibc).

    After millions of small arrays that are gone, the room between those that are left is in pieces that
    large ones do not fit into.
    """
    gc.collect()
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(ctypes.c_size_t(0))
