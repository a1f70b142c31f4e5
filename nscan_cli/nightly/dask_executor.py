"""Run tasks on a Dask cluster, whose workers start the same processes as `local_executor`.

Inputs and outputs are sent as bytes, so that the machines need no shared files. On a worker, too, each log
has a process of its own: if it dies, the worker and the other logs are not affected.
"""

from __future__ import annotations

import contextlib
import logging
import re
import tempfile
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path
from queue import Empty, Queue
from typing import Any

from nscan_cli.errors import InputMissingError, NscanError, WrongUsageError
from nscan_cli.files.inputs import read_bytes
from nscan_cli.logs.log_files import METADATA, files_of, journals_of
from nscan_cli.nightly.fingerprint import tool_key
from nscan_cli.nightly.local_executor import run_locally
from nscan_cli.nightly.task import Outcome, ProgressCallback, Task

ADDRESS = re.compile(r"[a-z]+://.+:\d+")
CONNECT_TIMEOUT = 10.0
"""The longest time that the scheduler may take to answer, s."""
InputFiles = dict[str, bytes]
"""Name → content of each file of an input."""
QUEUED_PER_THREAD = 2
"""Logs that are queued for each thread of the cluster: no thread waits, and not all logs are in memory."""


def run_on_dask(
    tasks: Sequence[Task], address: str, timeout: float | None, report: ProgressCallback
) -> Generator[tuple[Task, Outcome]]:
    """Run the tasks on the cluster of the scheduler with this address, and yield each when it is done.

    Closing the iterator cancels the tasks that have not begun. Raises WrongUsageError if Dask is not
    installed, and InputMissingError if no scheduler answers or the connection is lost.
    """
    client = _connect(address)
    topic = f"nscan-cli-{client.id}"
    client.subscribe_topic(topic, lambda event: report(*event[1]))
    waiting = deque(tasks)
    sent: dict[Any, Task] = {}
    done: Queue[Any] = Queue()
    try:
        while waiting or sent:
            room = QUEUED_PER_THREAD * max(1, sum(client.nthreads().values()))
            while waiting and len(sent) < room:
                task = waiting.popleft()
                try:
                    content = {role: _input_files(path, role) for role, path in task.inputs.items()}
                except NscanError as error:
                    yield task, Outcome.failed(str(error))
                    continue
                future = client.submit(run_on_worker, task, content, timeout, tool_key(), topic, pure=False)
                sent[future] = task
                future.add_done_callback(done.put)
            with contextlib.suppress(Empty):
                future = done.get(timeout=0.5)
                yield sent.pop(future), _future_outcome(future)
            if client.status != "running":
                raise InputMissingError(
                    f"--scheduler {address}: the connection is lost; start it and run this again"
                )
    finally:
        with contextlib.suppress(Exception):
            client.cancel(list(sent))
        client.close(timeout=2)


def run_on_worker(
    task: Task, content: dict[str, InputFiles], timeout: float | None, tool: str, topic: str
) -> Outcome:
    """On a Dask worker: run a task with the inputs sent along, and report its progress under the topic."""
    from distributed import get_worker

    worker = get_worker()
    if tool != tool_key():
        return Outcome.failed(
            f"a Dask worker has nscan-cli {tool_key()} instead of {tool}; install the same version"
        )
    with tempfile.TemporaryDirectory(prefix="nscan-cli.") as folder:
        inputs = {}
        for role, files in content.items():
            place = Path(folder, "received", role)
            for name, data in files.items():
                (place / name).parent.mkdir(parents=True, exist_ok=True)
                (place / name).write_bytes(data)
            inputs[role] = str(place / Path(task.inputs[role]).name)
        local = replace(task, inputs=inputs)
        run = run_locally([local], 1, timeout, Path(folder), lambda *said: worker.log_event(topic, said))
        with contextlib.closing(run):
            return next(run)[1]


def _input_files(path: str, role: str) -> InputFiles:
    """The files of an input; names of files in a folder begin with the folder's. Raises NscanError."""
    folder = Path(path)
    if role != "log" or not folder.is_dir():
        more = journals_of(path) if role == "log" else {}
        return {folder.name + end: read_bytes(name) for end, name in {"": path, **more}.items()}
    files = [*files_of(path), *(str(file) for file in (folder / METADATA,) if file.is_file())]
    return {f"{folder.name}/{Path(file).name}": read_bytes(file) for file in files}


def _connect(address: str) -> Any:
    if not ADDRESS.fullmatch(address):
        raise WrongUsageError(f"--scheduler {address}: is not an address of the form tcp://HOST:PORT")
    try:
        import distributed
    except ImportError as error:
        raise WrongUsageError(
            "nightly: --scheduler needs Dask: pip install 'nscan-cli[distributed]'"
        ) from error
    # Its log messages repeat what the error below says in one line.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    connect: Any = distributed.Client
    try:
        return connect(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputMissingError(
            f"--scheduler {address}: no Dask scheduler answers there; start one, or leave --scheduler out"
        ) from error


def _future_outcome(future: Any) -> Outcome:
    error = future.exception()
    if error is None:
        outcome: Outcome = future.result()
        return outcome
    kind = type(error).__name__
    if kind == "KilledWorker":
        return Outcome.failed("the Dask workers that ran it died")
    return Outcome.failed(f"on a Dask worker: {kind}: {error}")
