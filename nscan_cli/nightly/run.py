"""Run a plan: map and measure the logs, and write each log's results as soon as it is done."""

from __future__ import annotations

import contextlib
import datetime
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Protocol

from nscan_cli.nightly.fingerprint import tool_key
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.plan import Plan
from nscan_cli.nightly.results_folder import log_folder, scratch_folder
from nscan_cli.nightly.run_history import RunRecord, append_run
from nscan_cli.nightly.task import Outcome, ProgressCallback, Task

Outcomes = Generator[tuple[Task, Outcome]]
"""Yields each task with its outcome when the task is done. Closing it stops the running tasks."""
Executor = Callable[[list[Task], Path, ProgressCallback], Outcomes]
"""Runs tasks, given a folder for temporary files: `local_executor` or `dask_executor`."""


class RunObserver(Protocol):
    """Is notified of progress and of finished logs."""

    def progress(self, name: str, done: int, total: int, keyframes: int, /) -> None:
        """A log has so far `done` of `total` scans, and `keyframes`."""

    def finished(self, entry: ManifestEntry, record: RunRecord, /) -> None:
        """A log is done or has failed."""


def run_plan(planned: Plan, folder: Path, executor: Executor, observer: RunObserver) -> None:
    """Run the planned logs. Each log's results are written as soon as it is done.

    Raises OutputError and the errors of the executor.
    """
    for entry, reason in planned.unreadable:
        # An unreadable input has no hash, so its fingerprint equals no other.
        _finish(entry, "", Outcome.failed(reason), planned, folder, observer)
    entries = {entry.name: (entry, key) for entry, key in planned.to_do}
    if not entries:
        return
    with scratch_folder(folder) as scratch:
        tasks = [Task.of(entry) for entry, _key in planned.to_do]
        outcomes = executor(tasks, scratch, observer.progress)
        with contextlib.closing(outcomes):
            for task, outcome in outcomes:
                _finish(*entries[task.name], outcome, planned, folder, observer)


def _finish(
    entry: ManifestEntry, key: str, outcome: Outcome, planned: Plan, folder: Path, observer: RunObserver
) -> None:
    """Append the run of a log to its history, and tell the observer."""
    now = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
    record: RunRecord = {
        "key": key,
        "tool": tool_key(),
        "outcome": "failed" if "reason" in outcome.result else "done",
        "made_from": planned.made_from.get(entry.name),
        **{name: value for name, value in outcome.result.items() if name != "times"},
        "times": {
            **outcome.result.get("times", {}),
            "finished": now.isoformat().replace("+00:00", "Z"),
            "anew": planned.rerun_reasons.get(entry.name, []),
        },
    }
    append_run(log_folder(folder, entry.name), record, outcome.files)
    observer.finished(entry, record)
