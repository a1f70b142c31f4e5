"""Compilation is announced when a process compiles, and only then."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.kernels.kernels_kept import environment, write_module

KERNELS = """
from nscan_cli.kernels.decorators import kernel, leaf_kernel

@leaf_kernel
def doubled(a):
    return 2 * a

@kernel
def add(a, b):
    return a + doubled(b)

@kernel
def subtract(a, b):
    return a - doubled(b)

# By this name it is known whether a log was mapped.
@kernel
def track_scans(a, b):
    return a * doubled(b)
"""
COMMAND = """
import sys
import click
from nscan_cli.cli.compilation import Compiling
import some_kernels

@click.command()
def command():
    compiling = Compiling("long", quiet="-q" in sys.argv)
    for name in NAMES:
        getattr(some_kernels, name)(1.0, 2.0)
    print(compiling.has_begun)

command.main([], standalone_mode=False)
some_kernels.add(1, 2)
"""
TOLD = "compiling the kernels, once for this version on this machine: long\n"
TOLD_OF_MORE = "compiling kernels not needed before, once for this version on this machine\n"


def told(folder: Path, settings: dict[str, str], *names: str, quiet: bool = False) -> tuple[str, bool]:
    """What a new process says that calls these kernels, and whether it knows that it has compiled."""
    write_module(folder, KERNELS)
    code = COMMAND.replace("NAMES", repr(names))
    done = subprocess.run(
        [sys.executable, "-c", code, *(["-q"] if quiet else [])],
        env=environment(folder) | settings,
        capture_output=True,
        check=True,
        text=True,
    )
    return done.stderr, done.stdout == "True\n"


@pytest.mark.parametrize("settings", [{}, {"NUMBA_OPT": "2"}], ids=["kept by us", "kept by numba"])
def test_what_is_kept_is_not_announced(tmp_path: Path, settings: dict[str, str]):
    # The kernel with whole numbers that is compiled when the command has ended is no matter of its own.
    assert told(tmp_path, settings) == ("", False)
    assert told(tmp_path, settings, "add") == (TOLD, True)
    assert told(tmp_path, settings, "add") == ("", False)
    assert told(tmp_path, settings, "add", "subtract", quiet=True) == ("", True)
    assert told(tmp_path, settings, "subtract", "add") == ("", False)


@pytest.mark.parametrize("settings", [{}, {"NUMBA_OPT": "2"}], ids=["kept by us", "kept by numba"])
def test_of_few_kernels_no_long_time_is_told(tmp_path: Path, settings: dict[str, str]):
    assert told(tmp_path, settings, "track_scans") == (TOLD, True)
    assert told(tmp_path, settings, "add", "track_scans") == (TOLD_OF_MORE, True)
