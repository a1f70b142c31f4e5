"""The progress of `nightly`: a bar for every log on a terminal, elsewhere a line for each finished log."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from nscan_cli.cli.progress import say
from nscan_cli.files.text import counted
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import MeasuredErrors
from nscan_cli.nightly.run_history import RunRecord

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from nscan_cli.nightly.run import RunObserver


@contextlib.contextmanager
def night_progress(names: list[str], quiet: bool) -> Iterator[RunObserver]:
    """Show the progress of the logs `names` during the block."""
    if quiet or not sys.stderr.isatty():
        yield PlainProgress(quiet)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    # The bar fills the rest of the line.
    # A reason may quote anything, so it is not parsed as markup of rich.
    detail = TextColumn("{task.fields[detail]}", markup=False)
    columns = (TextColumn("{task.description}"), BarColumn(None), detail)
    with Progress(*columns, console=Console(stderr=True), refresh_per_second=4, expand=True) as bars:
        yield LiveProgress(bars, names)


class PlainProgress:
    """Prints a line for each finished log."""

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet

    def progress(self, name: str, done: int, total: int, keyframes: int) -> None:
        """Show nothing."""

    def finished(self, entry: ManifestEntry, night: RunRecord) -> None:
        """Print the outcome."""
        say(f"{entry.name}: {_outcome_line(night)}", self.quiet)


class LiveProgress:
    """A bar for every log on a terminal."""

    def __init__(self, bars: Progress, names: list[str]) -> None:
        self.bars = bars
        self.tasks: dict[str, TaskID] = {name: self._line(name) for name in names}

    def progress(self, name: str, done: int, total: int, keyframes: int) -> None:
        """Move the bar of the log."""
        task = self.tasks[name]
        if not self.bars.tasks[task].started:
            self.bars.start_task(task)
        elapsed = self.bars.tasks[task].elapsed or 0.0
        detail = f"{done}/{total} scans, {counted(keyframes, 'keyframe')}, {elapsed:.0f} s"
        self.bars.update(task, completed=done, total=total, detail=detail)

    def finished(self, entry: ManifestEntry, night: RunRecord) -> None:
        """Show the outcome in the line of the log."""
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
    measured = "" if errors is None else f"{errors.measure} {errors.metres:.4f} m, "
    if took is None:
        return f"{measured}not timed, because kernels were compiled"
    return f"{measured}{took:.1f} s, {counts['duration'] / max(took, 0.001):.0f} times real time"
