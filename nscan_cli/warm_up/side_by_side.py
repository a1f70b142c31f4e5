"""Compile kernels before they are needed, in two processes side by side.

`nightly` does so before the first log of a run, so that no log's time includes compilation, `slam` when
nothing is compiled yet, and `warm-up` on request.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from nscan_cli import bootstrap
from nscan_cli.kernels import machine_code
from nscan_cli.kernels.cache_folder import COMPILED_FILE, LOCK_FILE, cache_folder
from nscan_cli.kernels.compile_lock import kernels_in_work
from nscan_cli.warm_up import kernel_exercises

CompileProgress = Callable[[int, Sequence[str]], None]
"""Called with the kernels that have been compiled since the start, and the names of those in work."""
TRACKING_KERNEL = "track_scans"
"""The kernel (slam/frontend/tracking_kernels.py) without whose machine code all kernels are compiled anew."""
LOOK_INTERVAL = 0.1
"""Time between two looks at what is compiled, s."""


def compile_kernels(environment: Mapping[str, str]) -> None:
    """Compile the kernels that the cache lacks, in processes of their own, once on each machine.

    Does nothing if no cache folder is writable. Errors are ignored here: the logs will report them.
    """
    folder = cache_folder()
    if folder is None or _is_compiled(folder):
        return
    with contextlib.suppress(OSError), (folder / LOCK_FILE).open("w") as lock:
        # Other processes wait here for the first one, and then find the kernels compiled.
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _is_compiled(folder):
            compile_side_by_side(folder, kernel_exercises.FOR_ALL, environment, lambda *_progress: None)
            _compiled_file(folder).touch()


def cached_files() -> set[str]:
    """The files of the cache folder; a new one shows that a kernel was compiled."""
    folder = cache_folder()
    return set() if folder is None else {name for _, _, files in os.walk(folder) for name in files}


def is_cold() -> bool:
    """Whether processes can share what they compile, and the kernel of tracking is not compiled yet."""
    can_share = cache_folder() is not None and machine_code.build_key() is not None
    return can_share and machine_code.is_uncompiled(TRACKING_KERNEL)


def _is_compiled(folder: Path) -> bool:
    """Whether the kernels were compiled and not deleted since."""
    return _compiled_file(folder).exists() and not machine_code.is_uncompiled(TRACKING_KERNEL)


def _compiled_file(folder: Path) -> Path:
    return folder / f"{COMPILED_FILE}-{machine_code.build_key()}"


def compile_all(folder: Path, report: CompileProgress) -> None:
    """Compile the kernels that the cache folder lacks, for `nscan-cli warm-up`.

    What other processes have not compiled is compiled here, which raises their errors.
    """
    if is_cold():
        compile_side_by_side(folder, kernel_exercises.FOR_ALL, os.environ, report)
    for parts in kernel_exercises.FOR_ALL:
        kernel_exercises.main(*parts)
    _compiled_file(folder).touch()


def compile_side_by_side(
    folder: Path, shares: Sequence[Sequence[str]], environment: Mapping[str, str], report: CompileProgress
) -> None:
    """Run each share of the exercises in a process, and report which kernels the cache folder gets meanwhile.

    Does not say whether they succeed: what is not compiled afterwards is compiled where it is needed.
    """
    before = _compiled_count(folder)
    with contextlib.ExitStack() as stack:
        processes = [_started(share, environment) for share in shares]
        for process in processes:
            stack.callback(process.wait)
            stack.callback(process.kill)
        while any(process.poll() is None for process in processes):
            report(_compiled_count(folder) - before, kernels_in_work(folder))
            time.sleep(LOOK_INTERVAL)


def _started(share: Sequence[str], environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
    # An interrupt from the terminal is handled by the parent, which then kills the process.
    return subprocess.Popen(
        bootstrap.worker_command("warm_up.kernel_exercises", *share), env=environment, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def _compiled_count(folder: Path) -> int:
    return sum(1 for _ in folder.glob(f"*{machine_code.SUFFIX}"))
