"""Work beside other work: the kernels hold no lock, and what comes out does not depend on the threads."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Any, TypeVar

SWITCH_INTERVAL = 2e-4
"""s; a thread that comes out of a kernel waits for the interpreter so long at most. The kernels take about as
long, and by Python's own 5 ms both threads would wait most of the time."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def available_threads() -> int:
    """As many as this process may use at a time."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_in_threads(threads: int, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """What a function gives for each of the items, in their order."""
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(function, items))


def in_background(threads: int, function: Callable[[], Result]) -> Callable[[], Result]:
    """Call a function beside the caller's own work; with one thread, when its result is asked for.

    Returns what gives the result, or raises the function's error.
    """
    if threads < 2:
        return function
    pool = ThreadPoolExecutor(1)
    future = pool.submit(function)
    pool.shutdown(wait=False)
    return future.result


def completed_call(function: Callable[[], Result]) -> Future[Result]:
    """A call that is made here and now, as one that another thread has made: its error is kept in it."""
    future: Future[Result] = Future()
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error)
    return future


@contextlib.contextmanager
def short_switch_interval(threads: int) -> Iterator[None]:
    """Let several threads wait for the interpreter no longer than SWITCH, until it ends."""
    interval = sys.getswitchinterval()
    if threads > 1:
        sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        yield
    finally:
        sys.setswitchinterval(interval)


class BackgroundCalls:
    """Calls that are made one after another beside the caller's own work; at once if there is one thread.

    To be used with `with`: at its end all calls are made. The first error of a call is raised at the next
    call or there; after an error, the calls that still wait are not made.
    """

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(1) if threads > 1 else None
        self._turns = short_switch_interval(threads)
        self._calls: list[Future[Any]] = []

    def __call__(self, function: Callable[[Item], Any], item: Item) -> None:
        """Make this call when those before it are done."""
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
                # Who interrupts does not wait for what would be thrown away.
                self._pool.shutdown(wait=kind is not KeyboardInterrupt, cancel_futures=True)
