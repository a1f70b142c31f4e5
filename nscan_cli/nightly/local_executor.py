"""Run tasks in parallel on this machine, each in a process of its own: if one dies, the others still run."""

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

from nscan_cli import bootstrap
from nscan_cli.nightly.task import OUTPUTS, RESULT, TASK, Outcome, ProgressCallback, Task
from nscan_cli.warm_up.side_by_side import compile_kernels

THREADED_LIBRARIES = ("OPENBLAS", "MKL", "OMP")
"""Libraries that are limited to one thread a process: more would change the last digits of results."""
EXIT_TIMEOUT = 10.0
"""The longest time that a process may take to exit after it has closed its output, s."""


def run_locally(
    tasks: Sequence[Task],
    jobs: int,
    timeout: float | None,
    scratch: Path,
    report: ProgressCallback,
    threads: int = 1,
) -> Generator[tuple[Task, Outcome]]:
    """Run the tasks, `jobs` at a time, and yield each with its outcome when it is done.

    Each process uses this number of `threads` and is stopped if it takes longer than `timeout` (s). `scratch`
    is an existing folder for temporary files. Closing the iterator, or an interrupt, kills the running
    processes. All kernels are compiled before the first task starts.
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
    """The process of a task, from its start to its outcome."""

    def __init__(self, task: Task, scratch: Path, threads: int) -> None:
        self.task = task
        self.workspace = scratch / task.name
        self.began = time.monotonic()
        self._closed, self._unread = False, b""
        prepare_workspace(self.workspace, task, threads)
        with (self.workspace / "stderr.txt").open("wb") as errors:
            self.process = subprocess.Popen(
                bootstrap.worker_command("nightly.worker", str(self.workspace)),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=_environment(),
                # An interrupt from the terminal is handled by the parent alone.
                start_new_session=True,
            )
        assert self.process.stdout is not None
        self.output = self.process.stdout
        os.set_blocking(self.output.fileno(), False)

    def listen(self, report: ProgressCallback) -> None:
        """Read what the process prints, and report its latest progress."""
        printed = os.read(self.output.fileno(), 65536)
        self._closed = not printed
        *lines, self._unread = (self._unread + printed).split(b"\n")
        with contextlib.suppress(ValueError, TypeError):
            if lines:
                report(self.task.name, *json.loads(lines[-1]))

    def is_over(self, timeout: float | None) -> bool:
        """Whether the process has ended or exceeded its time."""
        return self._closed or self._is_late(timeout)

    def outcome(self, timeout: float | None) -> Outcome:
        """The outcome of the task; the process is stopped and its workspace removed."""
        late = not self._closed and self._is_late(timeout)
        if not late:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(EXIT_TIMEOUT)
        outcome = Outcome.failed(f"timed out after {timeout:g} s; see --timeout") if late else self._result()
        self.stop()
        return outcome

    def stop(self) -> None:
        """Kill the process, and remove its workspace."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.output):
            if pipe is not None:
                pipe.close()
        shutil.rmtree(self.workspace, ignore_errors=True)

    def _is_late(self, timeout: float | None) -> bool:
        return timeout is not None and time.monotonic() - self.began > timeout

    def _result(self) -> Outcome:
        try:
            result: dict[str, Any] = json.loads((self.workspace / RESULT).read_bytes())
        except (OSError, ValueError):
            return Outcome.failed(self._exit_reason())
        if "reason" in result:
            return Outcome.failed(result["reason"])
        files = {path.name: path.read_bytes() for path in sorted((self.workspace / OUTPUTS).iterdir())}
        return Outcome(result, files)

    def _exit_reason(self) -> str:
        code = self.process.poll()
        if code is not None and code < 0:
            return f"its process was killed by signal {-code}"
        lines = (self.workspace / "stderr.txt").read_text("utf-8", errors="replace").strip().splitlines()
        return f"its process ended with code {code}" + (f": {lines[-1]}" if lines else "")


def prepare_workspace(workspace: Path, task: Task, threads: int) -> None:
    """Make a workspace: links to the inputs, under the same names on every machine, and the task."""
    shutil.rmtree(workspace, ignore_errors=True)
    (workspace / OUTPUTS).mkdir(parents=True)
    for role, path in task.workspace_paths().items():
        (workspace / path).parent.mkdir()
        (workspace / path).symlink_to(task.inputs[role])
    (workspace / TASK).write_text(task.to_json(threads))


def _environment() -> dict[str, str]:
    environment = {**os.environ}
    for library in THREADED_LIBRARIES:
        environment.setdefault(f"{library}_NUM_THREADS", "1")
    # The process has another current folder.
    if environment.get("NUMBA_CACHE_DIR"):
        environment["NUMBA_CACHE_DIR"] = os.path.abspath(environment["NUMBA_CACHE_DIR"])
    return environment
