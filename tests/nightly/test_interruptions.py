"""Stopped at any moment and called again: the same folder as that of a night that nobody has disturbed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from nscan_cli.files.outputs import TEMPORARY_PREFIX
from nscan_cli.nightly.results_folder import locked_folder
from tests.nightly.small_logs import copy_of, results


def start(manifest: Path, folder: Path, *more: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "nscan_cli", "nightly", str(manifest), "-o", str(folder), *more]
    return subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


@pytest.mark.parametrize("seed", range(2))
def test_killed_at_random_moments_and_called_again(small, undisturbed, tmp_path, seed):
    """The moments are random, the result is not."""
    moments = random.Random(seed)
    folder = tmp_path / "nights"
    for _ in range(2):
        process = start(small, folder, "--jobs", "2")
        time.sleep(moments.uniform(0.1, 2.5))
        process.kill()
        process.communicate()
    assert run(["nightly", str(small), "-o", str(folder), "--jobs", "1", "-q"]) == 0
    assert results(folder) == results(undisturbed)


def test_an_interrupt_is_code_130_and_quick(small, undisturbed, tmp_path):
    folder = tmp_path / "nights"
    process = start(small, folder, "--jobs", "1")
    while not (folder / ".scratch").exists() or not os.listdir(folder / ".scratch"):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _out, err = process.communicate(timeout=10)
    assert process.returncode == 130
    assert b"Traceback" not in err
    assert not (folder / ".scratch").exists()
    assert run(["nightly", str(small), "-o", str(folder), "-q"]) == 0
    assert results(folder) == results(undisturbed)


def test_two_at_once_in_one_folder_are_refused(small, tmp_path, capsys):
    folder = tmp_path / "nights"
    with locked_folder(str(folder)):
        assert run(["nightly", str(small), "-o", str(folder)]) == 73
    assert "another nightly is running there" in capsys.readouterr().err


def test_what_was_half_written_is_cleared_away(small, undisturbed, tmp_path):
    folder = copy_of(undisturbed, tmp_path / "nights")
    for place in (folder, folder / "one"):
        (place / f"{TEMPORARY_PREFIX}x1y2").write_bytes(b"half")
    assert run(["nightly", str(small), "-o", str(folder), "-q"]) == 0
    assert results(folder) == results(undisturbed)
