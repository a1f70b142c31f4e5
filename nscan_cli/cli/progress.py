"""What a person sees while a command runs: a bar on a terminal, warnings and summaries; all on stderr."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

Advance = Callable[[int, str], None]


def say(message: str, quiet: bool = False) -> None:
    """One line for people."""
    if not quiet:
        print(message, file=sys.stderr)


def announce_compiling(kernel: str, quiet: bool) -> bool:
    """Say so where the kernels are still to be compiled, among them one that is needed; whether they are."""
    # As a whole: what imports names of it counts as a file with kernels, on which their cache hangs.
    from nscan_cli import compiled

    compiling = compiled.first_compile(kernel)
    if compiling:
        say("compiling the kernels, once for this version on this machine: about 20 s", quiet)
    return compiling


@contextlib.contextmanager
def progress(title: str, total: int, quiet: bool) -> Iterator[Advance]:
    """A progress bar, only on a terminal. Yields advance(done, detail), cheap enough to call per scan."""
    if quiet or not sys.stderr.isatty():
        yield lambda _done, _detail: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        Task,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Rate(ProgressColumn):
        """Steps a second."""

        def render(self, task: Task) -> Text:
            return Text("" if task.speed is None else f"{task.speed:.0f}/s")

    columns = (TextColumn("{task.description}"), BarColumn(None), MofNCompleteColumn(), Rate(),
               TextColumn("{task.fields[detail]}"), TimeRemainingColumn())  # fmt: skip
    # The bar has the room that the words leave.
    with Progress(*columns, console=Console(stderr=True), transient=True, expand=True) as bar:
        task = bar.add_task(title, total=total, detail="")
        yield lambda done, detail: bar.update(task, completed=done, detail=detail)
