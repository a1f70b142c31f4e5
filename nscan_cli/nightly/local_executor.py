"""Logs side by side in processes of this machine, one for each log: one that dies takes no other along."""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import shutil
import subprocess
import time
from collections import deque
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any

from nscan_cli.nightly import bootstrap
from nscan_cli.nightly.task import OUTPUTS, RESULT, TASK, Outcome, ProgressCallback, Task
from nscan_cli.nightly.warm_up import compile_kernels

THREADED_LIBRARIES = ("OPENBLAS", "MKL", "OMP")
"""One thread each: there are as many processes as there is work for, and digits depend on how many."""
EXIT_TIMEOUT = 10.0
"""A process that has closed its output is given so long to end, s."""


def run_locally(
    tasks: Sequence[Task],
    jobs: int,
    timeout: float | None,
    scratch: Path,
    report: ProgressCallback,
    threads: int = 1,
) -> Generator[tuple[Task, Outcome]]:
    """Do the tasks, `jobs` at a time, and yield each with its outcome when it is done.

    Each works in so many `threads`. One that takes longer than `timeout` (s) is stopped. `scratch` is an
    existing folder for what is only needed meanwhile. When the iterator is closed, or an interrupt comes,
    what is running is killed. The kernels are compiled before the first one begins.
    """
    compile_kernels(_environment())
    waiting, running = deque(tasks), set[WorkerProcess]()
    with selectors.DefaultSelector() as selector:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    work = WorkerProcess(waiting.popleft(), scratch, threads)
                    running.add(work)
                    selector.register(work.output, selectors.EVENT_READ, work)
                for key, _events in selector.select(0.5):
                    key.data.listen(report)
                for work in [each for each in running if each.is_over(timeout)]:
                    selector.unregister(work.output)
                    outcome = work.outcome(timeout)
                    running.remove(work)
                    yield work.task, outcome
        finally:
            for work in running:
                work.stop()


class WorkerProcess:
    """A log's process, from its start to its outcome."""

    def __init__(self, task: Task, scratch: Path, threads: int) -> None:
        self.task = task
        self.place = scratch / task.name
        self.began = time.monotonic()
        self._closed, self._said = False, b""
        prepare_workspace(self.place, task, threads)
        with (self.place / "stderr.txt").open("wb") as errors:
            self.process = subprocess.Popen(
                bootstrap.worker_command("worker", str(self.place)),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=_environment(),
                # An interrupt from the terminal is for the one that all are started by.
                start_new_session=True,
            )
        assert self.process.stdout is not None
        self.output = self.process.stdout
        os.set_blocking(self.output.fileno(), False)

    def listen(self, report: ProgressCallback) -> None:
        """Pass on what it says; its latest word is enough."""
        said = os.read(self.output.fileno(), 65536)
        self._closed = not said
        *lines, self._said = (self._said + said).split(b"\n")
        with contextlib.suppress(ValueError, TypeError):
            if lines:
                report(self.task.name, *json.loads(lines[-1]))

    def is_over(self, timeout: float | None) -> bool:
        """Whether it has ended, or has had its time."""
        return self._closed or self._is_late(timeout)

    def outcome(self, timeout: float | None) -> Outcome:
        """What became of it; its place is cleared away."""
        late = not self._closed and self._is_late(timeout)
        if not late:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(EXIT_TIMEOUT)
        outcome = Outcome.failed(f"stopped after {timeout:g} s, see --timeout") if late else self._result()
        self.stop()
        return outcome

    def stop(self) -> None:
        """Kill it, and clear its place."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.output):
            if pipe is not None:
                pipe.close()
        shutil.rmtree(self.place, ignore_errors=True)

    def _is_late(self, timeout: float | None) -> bool:
        return timeout is not None and time.monotonic() - self.began > timeout

    def _result(self) -> Outcome:
        try:
            result: dict[str, Any] = json.loads((self.place / RESULT).read_bytes())
        except (OSError, ValueError):
            return Outcome.failed(self._how_it_died())
        if "reason" in result:
            return Outcome.failed(result["reason"])
        files = {path.name: path.read_bytes() for path in sorted((self.place / OUTPUTS).iterdir())}
        return Outcome(result, files)

    def _how_it_died(self) -> str:
        code = self.process.poll()
        if code is not None and code < 0:
            return f"its process was killed by signal {-code}"
        said = (self.place / "stderr.txt").read_text("utf-8", errors="replace").strip().splitlines()
        return f"its process ended with code {code}" + (f": {said[-1]}" if said else "")


def prepare_workspace(place: Path, task: Task, threads: int) -> None:
    """A place of work: the inputs under the same names on every machine, and the task."""
    shutil.rmtree(place, ignore_errors=True)
    (place / OUTPUTS).mkdir(parents=True)
    for role, path in task.places().items():
        (place / path).parent.mkdir()
        (place / path).symlink_to(task.inputs[role])
    (place / TASK).write_text(task.to_json(threads))


def _environment() -> dict[str, str]:
    environment = {**os.environ}
    for library in THREADED_LIBRARIES:
        environment.setdefault(f"{library}_NUM_THREADS", "1")
    # The process works in another folder.
    if environment.get("NUMBA_CACHE_DIR"):
        environment["NUMBA_CACHE_DIR"] = os.path.abspath(environment["NUMBA_CACHE_DIR"])
    return environment
