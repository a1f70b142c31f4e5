"""Work beside other work: in order, complete, and with its errors told."""

from __future__ import annotations

import sys
import threading
import time

import pytest

from nscan_cli.threads import BackgroundCalls, available_threads, in_background, map_in_threads

THREADS = pytest.mark.parametrize("threads", [1, 2, 5])


@THREADS
def test_results_come_in_the_order_of_the_items(threads):
    def slower_at_first(item: int) -> int:
        time.sleep(0.002 * (9 - item))
        return item * item

    assert map_in_threads(threads, slower_at_first, range(10)) == [k * k for k in range(10)]


def test_one_thread_is_the_callers_own():
    own = threading.get_ident()
    assert map_in_threads(1, lambda _: threading.get_ident(), range(3)) == [own] * 3
    seen: list[int] = []
    with BackgroundCalls(1) as beside:
        beside(lambda _: seen.append(threading.get_ident()), 0)
        assert seen == [own]


@THREADS
def test_what_is_called_meanwhile_gives_its_result_or_its_error(threads):
    assert in_background(threads, lambda: 7)() == 7
    called: list[int] = []

    def fail() -> None:
        called.append(threading.get_ident())
        raise ValueError("at last")

    result = in_background(threads, fail)
    with pytest.raises(ValueError, match="at last"):
        result()
    assert (called == [threading.get_ident()]) == (threads == 1)


def test_beside_leaves_the_interpreter_as_it_was():
    before = sys.getswitchinterval()
    with BackgroundCalls(2):
        assert sys.getswitchinterval() < before
    assert sys.getswitchinterval() == before


@THREADS
def test_calls_beside_are_made_one_after_another_and_all_before_the_end(threads):
    made, busy = [], threading.Lock()

    def call(item: int) -> None:
        assert busy.acquire(blocking=False)
        time.sleep(0.001)
        made.append(item)
        busy.release()

    with BackgroundCalls(threads) as beside:
        for k in range(20):
            beside(call, k)
    assert made == list(range(20))


@THREADS
def test_an_error_beside_is_raised_and_ends_it(threads):
    made = []

    def call(item: int) -> None:
        made.append(item)
        if item == 3:
            raise ValueError("the fourth")

    def hundred() -> None:
        with BackgroundCalls(threads) as beside:
            for k in range(100):
                beside(call, k)
                time.sleep(0.001)

    with pytest.raises(ValueError, match="the fourth"):
        hundred()
    assert made[:4] == [0, 1, 2, 3]
    assert len(made) < 100


@THREADS
def test_after_the_callers_own_error_nothing_waits(threads):
    made: list[int] = []

    def call(item: int) -> None:
        time.sleep(0.01)
        made.append(item)

    def interrupted() -> None:
        with BackgroundCalls(threads) as beside:
            for k in range(6):
                beside(call, k)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert len(made) <= 6


def test_there_is_a_thread_at_least():
    assert available_threads() >= 1
