"""Threads. Kernels release the GIL; results do not depend on the number of threads."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Any, TypeVar

SWITCH_INTERVAL = 2e-4
"""The longest wait for the GIL, s. It is about the time of a kernel. With Python's 5 ms, threads that leave
kernels would wait most of the time."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def available_threads() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_in_threads(threads: int, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """The results of a function for all items, in their order."""
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(function, items))


def in_background(threads: int, function: Callable[[], Result]) -> Callable[[], Result]:
    """Call a function in another thread; if `threads` is 1, when the result is requested.

    Returns a function that waits for the result, or raises the error of the call.
    """
    if threads < 2:
        return function
    pool = ThreadPoolExecutor(1)
    future = pool.submit(function)
    pool.shutdown(wait=False)
    return future.result


def completed_call(function: Callable[[], Result]) -> Future[Result]:
    """Call a function in this thread, and return a completed Future with its result or error."""
    future: Future[Result] = Future()
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error)
    return future


@contextlib.contextmanager
def short_switch_interval(threads: int) -> Iterator[None]:
    """Set the switch interval to SWITCH_INTERVAL during the block, if there are several threads."""
    interval = sys.getswitchinterval()
    if threads > 1:
        sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        yield
    finally:
        sys.setswitchinterval(interval)


class BackgroundCalls:
    """A queue of calls in one background thread, in order; with one thread, each call is made at once.

    A context manager: at its end it waits for all calls. The first error of a call is raised at the next call
    or at the end, and the remaining calls are dropped.
    """

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(1) if threads > 1 else None
        self._turns = short_switch_interval(threads)
        self._calls: list[Future[Any]] = []

    def __call__(self, function: Callable[[Item], Any], item: Item) -> None:
        """Queue a call."""
        if self._pool is None:
            function(item)
            return
        while self._calls and self._calls[0].done():
            self._calls.pop(0).result()
        self._calls.append(self._pool.submit(function, item))

    def __enter__(self) -> BackgroundCalls:
        self._turns.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            for call in self._calls if kind is None else ():
                call.result()
        finally:
            self._turns.__exit__(None, None, None)
            if self._pool is not None:
                # After Ctrl-C, do not wait for results that are dropped.
                self._pool.shutdown(wait=kind is not KeyboardInterrupt, cancel_futures=True)
