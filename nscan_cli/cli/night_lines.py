"""What a person sees of a night: a line for every log, alive on a terminal, plain elsewhere."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from nscan_cli.cli.progress import say
from nscan_cli.files.counting import counted
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import MeasuredErrors
from nscan_cli.nightly.run_history import RunRecord

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from nscan_cli.nightly.run import RunObserver


@contextlib.contextmanager
def night_progress(names: list[str], quiet: bool) -> Iterator[RunObserver]:
    """The lines of the logs that are to be done, as long as the block lasts."""
    if quiet or not sys.stderr.isatty():
        yield PlainProgress(quiet)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    # The bar has the room that the words leave.
    # A reason may quote anything: none of it is rich's own markup.
    detail = TextColumn("{task.fields[detail]}", markup=False)
    columns = (TextColumn("{task.description}"), BarColumn(None), detail)
    with Progress(*columns, console=Console(stderr=True), refresh_per_second=4, expand=True) as bars:
        yield LiveProgress(bars, names)


class PlainProgress:
    """A line when a log is done."""

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet

    def progress(self, name: str, done: int, total: int, keyframes: int) -> None:
        """Nothing."""

    def finished(self, entry: ManifestEntry, night: RunRecord) -> None:
        """Say what became of it."""
        say(f"{entry.name}: {_outcome_line(night)}", self.quiet)


class LiveProgress:
    """A bar for every log, from the beginning."""

    def __init__(self, bars: Progress, names: list[str]) -> None:
        self.bars = bars
        self.tasks: dict[str, TaskID] = {name: self._line(name) for name in names}

    def progress(self, name: str, done: int, total: int, keyframes: int) -> None:
        """Move its bar."""
        task = self.tasks[name]
        if not self.bars.tasks[task].started:
            self.bars.start_task(task)
        elapsed = self.bars.tasks[task].elapsed or 0.0
        detail = f"{done}/{total} scans, {counted(keyframes, 'keyframe')}, {elapsed:.0f} s"
        self.bars.update(task, completed=done, total=total, detail=detail)

    def finished(self, entry: ManifestEntry, night: RunRecord) -> None:
        """Say in its line what became of it."""
        if entry.name not in self.tasks:
            self.tasks[entry.name] = self._line(entry.name)
        task = self.tasks[entry.name]
        total = self.bars.tasks[task].total or 1
        completed = total if night["outcome"] == "done" else None
        self.bars.update(task, completed=completed, total=total, detail=_outcome_line(night))
        self.bars.stop_task(task)

    def _line(self, name: str) -> TaskID:
        return self.bars.add_task(name, total=None, start=False, detail="")


def _outcome_line(night: RunRecord) -> str:
    if night["outcome"] != "done":
        return f"failed: {night['reason']}"
    errors, took, counts = MeasuredErrors.of(night), night["times"]["seconds"], night["counts"]
    measured = "" if errors is None else f"{errors.what} {errors.metres:.4f} m, "
    if took is None:
        return f"{measured}not timed: kernels were compiled meanwhile"
    return f"{measured}{took:.1f} s, {counts['duration'] / max(took, 0.001):.0f} times real time"
