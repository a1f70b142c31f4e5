"""Messages and progress bars of a running command, on standard error."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from nscan_cli.files.text import printable

if TYPE_CHECKING:
    from rich.progress import Progress


def say(message: str, quiet: bool = False) -> None:
    """Print a message, unless `quiet`."""
    if not quiet:
        print(printable(message), file=sys.stderr)


class Bar:
    """A progress bar. This one shows nothing; it is used without a terminal."""

    def begin(self, title: str, total: int | None) -> None:
        """Begin a task of `total` steps, None if the number is unknown."""

    def advance(self, done: int, detail: str) -> None:
        """Set the number of steps done. It is fast enough to be called at every scan."""


class LiveBar(Bar):
    """A progress bar on a terminal."""

    def __init__(self, live: Progress, title: str, total: int | None) -> None:
        self._live, self._task = live, live.add_task(title, total=total, detail="")

    def begin(self, title: str, total: int | None) -> None:
        """Show the final state of the task before, then replace it."""
        self._live.refresh()
        self._live.remove_task(self._task)
        self._task = self._live.add_task(title, total=total, detail="")

    def advance(self, done: int, detail: str) -> None:
        """Set the number of steps done; the bar is drawn ten times per second."""
        self._live.update(self._task, completed=done, detail=detail)


@contextlib.contextmanager
def progress(title: str, total: int | None, quiet: bool) -> Iterator[Bar]:
    """A progress bar for the block, shown on a terminal only and removed at the end."""
    if quiet or not sys.stderr.isatty():
        yield Bar()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
    from rich.text import Text

    class Steps(ProgressColumn):
        """Steps done, and steps per second."""

        def render(self, task: Task) -> Text:
            if task.total is None:
                return Text("")
            speed = "" if task.speed is None else f" {task.speed:.0f}/s"
            return Text(f"{task.completed:.0f}/{task.total:.0f}{speed}")

    columns = (TextColumn("{task.description}"), BarColumn(None), Steps(),
               TextColumn("{task.fields[detail]}"), TimeRemainingColumn())  # fmt: skip
    # The bar fills the rest of the line.
    with Progress(*columns, console=Console(stderr=True), transient=True, expand=True) as live:
        yield LiveBar(live, title, total)
