"""Commands that compile kernels: what they say, and the bar of processes that compile side by side."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nscan_cli.cli.progress import progress, say

if TYPE_CHECKING:
    from nscan_cli.logs.laser_log import LaserLog
    from nscan_cli.warm_up.side_by_side import CompileProgress

COMPILING = "compiling the kernels, once for this version on this machine"
COMPILING_MORE = "compiling kernels not needed before, once for this version on this machine"
SLAM_KERNELS, ALL_KERNELS = 47, 69
"""About how many kernels `slam` compiles, and `warm-up`: for the bar alone."""


def announce_compiling(kernel: str, quiet: bool) -> None:
    """Print a message if `kernel`, which other processes need, is not compiled yet."""
    from nscan_cli.kernels.machine_code import is_uncompiled

    if is_uncompiled(kernel):
        say(f"{COMPILING}: half a minute to a minute", quiet)


class Compiling:
    """Prints a message when this process begins to compile kernels, and records that it did.

    `takes` is the usual time in words where most are not compiled. The rest takes seconds: no time is said.
    """

    def __init__(self, takes: str, quiet: bool) -> None:
        from nscan_cli.kernels.decorators import on_first_compile
        from nscan_cli.kernels.machine_code import is_uncompiled
        from nscan_cli.warm_up.side_by_side import TRACKING_KERNEL

        self.has_begun = False
        # Not when it begins: the kernel that is compiled then has a file already, its lock.
        self._are_most = is_uncompiled(TRACKING_KERNEL)
        self._takes, self._quiet = takes, quiet
        on_first_compile(self._begin)
        context = click.get_current_context(silent=True)
        if context is not None:
            context.call_on_close(lambda: on_first_compile(None))

    def _begin(self) -> None:
        if not self.has_begun:
            self.has_begun = True
            say(f"{COMPILING}: {self._takes}" if self._are_most else COMPILING_MORE, self._quiet)

    def beforehand_for_slam(self, log: LaserLog) -> None:
        """Compile what `slam` needs for a log in two processes; the cache folder has to be there."""
        from nscan_cli.kernels.cache_folder import cache_folder
        from nscan_cli.warm_up import kernel_exercises, side_by_side

        folder = cache_folder()
        assert folder is not None
        self._begin()
        with self._bar(SLAM_KERNELS) as report:
            side_by_side.compile_side_by_side(folder, kernel_exercises.for_slam(log), os.environ, report)

    def all(self, folder: Path) -> None:
        """Compile all kernels that the cache folder lacks, in two processes if it has none."""
        from nscan_cli.warm_up import side_by_side

        if side_by_side.is_cold():
            self._begin()
        with self._bar(ALL_KERNELS) as report:
            side_by_side.compile_all(folder, report)

    @contextlib.contextmanager
    def _bar(self, kernels: int) -> Iterator[CompileProgress]:
        """A bar for about this many kernels: which are compiled now, and how many are left."""
        with progress("compiling", kernels, self._quiet) as bar:
            yield lambda done, names: bar.advance(min(done, kernels), ", ".join(names))
