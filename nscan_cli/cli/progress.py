"""What a person sees while a command runs: a bar on a terminal, warnings and summaries; all on stderr."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from nscan_cli.files.text import printable

if TYPE_CHECKING:
    from rich.progress import Progress


def say(message: str, quiet: bool = False) -> None:
    """One line for people."""
    if not quiet:
        print(printable(message), file=sys.stderr)


COMPILING = "compiling the kernels, once for this version on this machine"


def announce_compiling(kernel: str, quiet: bool) -> bool:
    """Say so where the kernels are still to be compiled, among them one that is needed; whether they are.

    This is for kernels of other processes.
    """
    from nscan_cli.kernels.machine_code import is_uncompiled

    compiling = is_uncompiled(kernel)
    if compiling:
        say(f"{COMPILING}: a minute or two", quiet)
    return compiling


class Compiling:
    """Whether the running command has compiled kernels since this was made; it is said when that begins.

    `takes` is how long, as people say it.
    """

    def __init__(self, takes: str, quiet: bool) -> None:
        from nscan_cli.kernels.decorators import on_first_compile

        self.has_begun = False
        self._takes, self._quiet = takes, quiet
        on_first_compile(self._begin)
        context = click.get_current_context(silent=True)
        if context is not None:
            context.call_on_close(lambda: on_first_compile(None))

    def _begin(self) -> None:
        self.has_begun = True
        say(f"{COMPILING}: {self._takes}", self._quiet)


class Bar:
    """How far the work is. This one shows nothing, where there is no terminal."""

    def begin(self, title: str, total: int | None) -> None:
        """A piece of work of so many steps, of which the bar tells from now on; None where nobody knows."""

    def advance(self, done: int, detail: str) -> None:
        """So many steps are done; cheap enough to be called at every scan."""


class LiveBar(Bar):
    """One on a terminal."""

    def __init__(self, live: Progress, title: str, total: int | None) -> None:
        self._live, self._task = live, live.add_task(title, total=total, detail="")

    def begin(self, title: str, total: int | None) -> None:
        """The last state of the work before is shown once more, and its line used again."""
        self._live.refresh()
        self._live.remove_task(self._task)
        self._task = self._live.add_task(title, total=total, detail="")

    def advance(self, done: int, detail: str) -> None:
        """Shown at the next of ten times a second."""
        self._live.update(self._task, completed=done, detail=detail)


@contextlib.contextmanager
def progress(title: str, total: int | None, quiet: bool) -> Iterator[Bar]:
    """A bar that has begun, and is gone at the end; shown on a terminal only."""
    if quiet or not sys.stderr.isatty():
        yield Bar()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
    from rich.text import Text

    class Steps(ProgressColumn):
        """How many are done, and a second."""

        def render(self, task: Task) -> Text:
            if task.total is None:
                return Text("")
            speed = "" if task.speed is None else f" {task.speed:.0f}/s"
            return Text(f"{task.completed:.0f}/{task.total:.0f}{speed}")

    columns = (TextColumn("{task.description}"), BarColumn(None), Steps(),
               TextColumn("{task.fields[detail]}"), TimeRemainingColumn())  # fmt: skip
    # The bar has the room that the words leave.
    with Progress(*columns, console=Console(stderr=True), transient=True, expand=True) as live:
        yield LiveBar(live, title, total)
