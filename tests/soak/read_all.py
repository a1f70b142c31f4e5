"""Damaged input for the readers, in a process of its own whose death or silence is a fault."""

from __future__ import annotations

import itertools
import multiprocessing
import random
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from tests.soak.corpus import samples
from tests.soak.mutations import damaged

HANG = 10.0
"""s"""
START_UP = 60.0
"""s for the process to begin; imports, and the samples are made."""
ADDRESS_SPACE = 6 << 30
LARGEST_PEAK = 400 << 20
"""Bytes of memory; inputs have less than half a megabyte."""
Counts = Counter[tuple[str, str]]


def soak(seconds: float, seed: int, folder: Path) -> tuple[Counts, int]:
    """How often which form had which outcome, and the number of faults; these are saved in `folder`."""
    counts: Counts = Counter()
    faults, first = 0, 0
    end = time.monotonic() + seconds
    context = multiprocessing.get_context("spawn")
    while time.monotonic() < end:
        ours, theirs = context.Pipe()
        worker = context.Process(target=_work, args=(theirs, seed, first, end - time.monotonic()))
        worker.start()
        theirs.close()
        number, ended = _listen(ours, counts, folder, seed)
        worker.kill() if not ended else None
        worker.join()
        faults = sum(count for (_, what), count in counts.items() if what.startswith("FAULT"))
        if ended:
            break
        first = number + 1
    return counts, faults


def mutant(seed: int, number: int, every: dict[str, list[bytes]]) -> tuple[str, bytes, random.Random]:
    """The input of a number: its form, the damaged bytes, and the chance to go on with."""
    chance = random.Random(f"{seed}/{number}")
    form = sorted(every)[number % len(every)]
    return form, damaged(chance.choice(every[form]), form, chance), chance


def _listen(worker: Connection, counts: Counts, folder: Path, seed: int) -> tuple[int, bool]:
    """Count what the worker says until it ends well (True), dies or falls silent; the last input's number."""
    number, form, data = -1, "start", b""
    while True:
        patience = HANG if number >= 0 else START_UP
        if not worker.poll(patience):
            what = "FAULT: no answer within 10 s"
            break
        try:
            said = worker.recv()
        except EOFError:
            what = "FAULT: the process died"
            break
        if said is None:
            return number, True
        if len(said) == 3:
            number, form, data = said
            continue
        what, trace = said
        counts[form, what] += 1
        if what.startswith("FAULT"):
            _save(folder, seed, number, form, data, f"{what}\n{trace}")
    counts[form, what] += 1
    _save(folder, seed, number, form, data, what)
    return number, False


def _save(folder: Path, seed: int, number: int, form: str, data: bytes, text: str) -> None:
    name = f"{form.replace(' ', '_').replace(',', '')}-{seed}-{number}"
    (folder / f"{name}.bin").write_bytes(data)
    (folder / f"{name}.txt").write_text(text)


def _work(parent: Any, seed: int, first: int, seconds: float) -> None:
    from tests.soak.readers import outcome

    end = time.monotonic() + seconds
    every = samples()
    # A user would see them.
    warnings.simplefilter("error", RuntimeWarning)
    peak = _peak()
    limit = max(ADDRESS_SPACE, peak)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    with tempfile.TemporaryDirectory(prefix="soak.") as folder, open("/dev/null", "w") as null:
        sys.stdout = null
        path = Path(folder) / "input"
        for number in itertools.count(first):
            if time.monotonic() > end:
                parent.send(None)
                return
            form, data, chance = mutant(seed, number, every)
            parent.send((number, form, data))
            path.write_bytes(data)
            try:
                said = (outcome(form, str(path), chance), "")
            except BaseException as error:
                said = (f"FAULT: {type(error).__name__}", traceback.format_exc())
            if _peak() - peak > LARGEST_PEAK:
                said = (f"FAULT: {(_peak() - peak) >> 20} MB of memory", said[1])
            peak = max(peak, _peak())
            parent.send(said)


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
