"""A machine that fails in the middle of `slam`: killed, interrupted, no room, nobody who reads."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from nscan_cli.files.outputs import TEMPORARY_PREFIX
from tests.cli.room_logs import ALL_OUTPUTS, room_log

SCANS = 40
KILLS = int(os.environ.get("NSCAN_TEST_KILLS", "4"))


def start(folder: Path, *more: str, before: Callable[[], object] | None = None) -> subprocess.Popen[bytes]:
    def prepared() -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if before is not None:
            before()

    command = [sys.executable, "-m", "nscan_cli", "slam", "room.log", "--threads", "2", *more]
    return subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=prepared
    )


def outputs(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "room.log"}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], float]:
    """All outputs of a run that nothing has stopped, and the seconds that it took."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "room.log").write_text(room_log(SCANS))
    began = time.monotonic()
    assert start(folder, *ALL_OUTPUTS).wait(120) == 0
    return outputs(folder), time.monotonic() - began


def test_killed_at_random_moments(undisturbed, tmp_path):
    """The moments are random; each output is then the old one or the new one, and whole."""
    new, seconds = undisturbed
    old = {name: b"old " + name.encode() for name in new}
    (tmp_path / "room.log").write_text(room_log(SCANS))
    moments = random.Random(1)
    for _ in range(KILLS):
        for name, content in old.items():
            (tmp_path / name).write_bytes(content)
        process = start(tmp_path, *ALL_OUTPUTS)
        # Later moments are of more interest: the files are written at the end.
        time.sleep(seconds * moments.uniform(0.5, 1.05))
        process.kill()
        process.communicate()
        left = outputs(tmp_path)
        assert sum(name.startswith(TEMPORARY_PREFIX) for name in left) <= 1
        for name in new:
            assert left[name] in (old[name], new[name])
    assert start(tmp_path, *ALL_OUTPUTS).wait(120) == 0
    assert outputs(tmp_path) == new


def test_an_interrupt_while_two_threads_work_is_quick_and_quiet(tmp_path):
    """The log goes on for longer than anyone waits."""
    (tmp_path / "room.log").write_text(room_log(20_000))
    process = start(tmp_path, "-q", "-o", "out.json")
    time.sleep(3)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=10)
    # Click ends the line in which a terminal shows ^C.
    assert (process.returncode, out, err) == (130, b"", b"\n")
    assert outputs(tmp_path) == {}


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_goes_away_is_code_141(tmp_path, monkeypatch, unbuffered):
    """The graph is longer than a pipe holds."""
    monkeypatch.setenv("PYTHONUNBUFFERED", unbuffered)
    (tmp_path / "room.log").write_text(room_log(20 * SCANS))
    process = start(tmp_path, "-q", "--no-loops", "--relations", "pairwise")
    assert process.stdout is not None
    process.stdout.read(10)
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    assert process.wait(10) == 141


def test_a_disk_that_gets_full_is_code_73_and_keeps_the_old_files(undisturbed, tmp_path):
    new, _ = undisturbed
    (tmp_path / "room.log").write_text(room_log(SCANS))
    (tmp_path / "out.json").write_bytes(b"old")
    room = len(new["out.json"]) // 2
    process = start(
        tmp_path, *ALL_OUTPUTS, before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
    )
    _, err = process.communicate(timeout=120)
    assert process.returncode == 73
    assert err.splitlines()[-1] == b"nscan-cli: out.json: cannot be written: File too large; choose another"
    assert outputs(tmp_path) == {"out.json": b"old"}
