"""Whole runs of the commands on damaged input, each in a process of its own with bounds."""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.cli.room_logs import ALL_OUTPUTS, room_log
from tests.graph.small_graph import read_tum
from tests.soak.corpus import RELATION, samples
from tests.soak.mutations import damaged

PROMISED = (0, 2, 3, 65, 66, 73)
TIMEOUT = 60
"""s"""
ADDRESS_SPACE = 8 << 30
Counts = Counter[tuple[str, str]]


def soak(seconds: float, seed: int, faults: Path) -> tuple[Counts, int]:
    """How often which command had which outcome, and the number of faults; these are saved in `faults`."""
    counts: Counts = Counter()
    with tempfile.TemporaryDirectory(prefix="soak.") as name:
        folder = Path(name)
        graph = _prepared(folder)
        every = samples()
        end = time.monotonic() + seconds
        for number in itertools.count():
            if time.monotonic() > end:
                break
            chance = random.Random(f"{seed}/run/{number}")
            arguments, data = _chosen(chance, every, graph)
            (folder / "input").write_bytes(data)
            what = _outcome(arguments, folder)
            counts[arguments[0], what] += 1
            if what.startswith("FAULT"):
                _save(faults, f"run-{seed}-{number}", arguments, data, folder)
            for path in folder.glob("out*"):
                path.unlink()
    return counts, sum(count for (_, what), count in counts.items() if what.startswith("FAULT"))


def _prepared(folder: Path) -> bytes:
    """A sound log and its graph in the folder, and the kernels loaded: children need not do it again."""
    from nscan_cli.cli.main import run

    os.chdir(folder)
    Path("room.log").write_text(room_log(25))
    Path("room.relations").write_text(RELATION)
    # One thread: a process with several must not be copied.
    if run(["slam", "room.log", "-q", "-o", "room.json", "--threads", "1", "--map", "room.png"]):
        raise RuntimeError("the sound log is no good")
    graph = Path("room.json").read_bytes()
    run(["render", "room.json", "-q", "-o", "room2.png", "--style", "paper"])
    run(["slam", "--from", "room.json", "-q", "-o", "room3.json", "--threads", "1"])
    with contextlib.redirect_stdout(io.StringIO()):
        run(["evaluate", "room.json", "--relations", "room.relations", "--plot", "room4.png"])
    return graph


def _chosen(chance: random.Random, every: dict[str, list[bytes]], graph: bytes) -> tuple[list[str], bytes]:
    """A command line by chance, and the damaged bytes that it reads."""
    logs = [form for form in every if form.startswith(("recording", "carmen", "player", "script", "gzip"))]
    kind = chance.randrange(8)
    if kind < 4:
        form = chance.choice([*logs, "carmen", "carmen", "carmen"])
        data = damaged(chance.choice(every[form]), form, chance)
        command = ["info", "input"] if kind == 0 else ["slam", "input", "--threads", "1", "-q", *ALL_OUTPUTS]
        return command + (["--allow-corrected"] if chance.random() < 0.5 else []), data
    if kind == 4:
        form = chance.choice(["tum", "relations", "carmen", "json graph"])
        data = damaged(chance.choice(every[form]), form, chance)
        if form == "relations":
            return ["evaluate", "room.json", "--relations", "input", "--plot", "out.png"], data
        return ["evaluate", "input", "--relations", "room.relations"], data
    data = damaged(graph, "json graph", chance)
    if kind == 5:
        extra = chance.choice([["--graph", "--uncertainty"], ["--style", "paper"], ["--mcap", "out.mcap"]])
        return ["render", "input", "room.log", "-q", "-o", "out.png", *extra], data
    if kind == 6:
        return ["slam", "--from", "input", "room.log", "--threads", "1", "-q", *ALL_OUTPUTS], data
    data = damaged(every["g2o"][0], "g2o", chance)
    return ["slam", "--from", "input", "-q", "-o", "out.json", "--g2o", "out.g2o"], data


def _outcome(arguments: list[str], folder: Path) -> str:
    child = os.fork()
    if child == 0:
        _run(arguments, folder)
    _, status = os.waitpid(child, 0)
    said = (folder / "out.stderr").read_text(errors="replace")
    code = os.waitstatus_to_exitcode(status)
    if code == -signal.SIGALRM:
        return f"FAULT: no end within {TIMEOUT} s"
    if code not in PROMISED:
        return f"FAULT: exit code {code}"
    if "Traceback" in said or "internal error" in said or "Warning:" in said:
        return "FAULT: a traceback or a warning of Python's"
    errors = [line for line in said.splitlines() if line.startswith("nscan-cli:")]
    if (code not in (0, 3)) and len(errors) != 1:
        return "FAULT: not one line of error"
    if any(folder.glob(".nscan-cli.*")):
        return "FAULT: a temporary file is left"
    return _unreadable(folder) or f"exit code {code}"


def _unreadable(folder: Path) -> str:
    """What is wrong with the files that a run has left; empty when all read back."""
    readers: dict[str, Callable[[str], object]] = {
        "out.json": load_graph, "out.g2o": load_graph, "out.tum": read_tum, "out.log": _log,
    }  # fmt: skip
    for name, read in readers.items():
        if (folder / name).exists():
            try:
                read(str(folder / name))
            except Exception as error:
                return f"FAULT: {name} cannot be read: {type(error).__name__}"
    return ""


def _log(path: str) -> None:
    read_log(path, ReadingOptions(allow_corrected=True))


def _run(arguments: list[str], folder: Path) -> None:
    """In the child: the command, and its end."""
    code = 99
    try:
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(TIMEOUT)
        out = os.open(folder / "out.stderr", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        from nscan_cli.cli.main import run

        code = run(arguments)
        sys.stderr.flush()
    finally:
        os._exit(code)


def _save(faults: Path, name: str, arguments: list[str], data: bytes, folder: Path) -> None:
    (faults / f"{name}.bin").write_bytes(data)
    said = (folder / "out.stderr").read_text(errors="replace")
    (faults / f"{name}.txt").write_text(f"{' '.join(arguments)}\n{said}")
