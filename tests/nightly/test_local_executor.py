"""Processes that go wrong: each costs its own log alone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from typing import Any

import pytest

from nscan_cli import bootstrap
from nscan_cli.nightly import local_executor
from nscan_cli.nightly.local_executor import run_locally
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.task import Outcome, Task
from tests.cli.room_logs import COUNT, room_log
from tests.nightly.small_logs import recordings


def nothing(*_said):
    pass


@pytest.fixture
def fine(tmp_path):
    (tmp_path / "fine.log").write_text(room_log(12))
    return Task.of(ManifestEntry("fine", {"log": tmp_path / "fine.log"}))


@pytest.fixture
def endless(tmp_path):
    """A log that nobody ever writes to the end."""
    os.mkfifo(tmp_path / "endless.log")
    return Task.of(ManifestEntry("endless", {"log": tmp_path / "endless.log"}))


@pytest.fixture
def scratch(tmp_path):
    (tmp_path / "scratch").mkdir()
    return tmp_path / "scratch"


def outcomes(*arguments: Any) -> dict[str, Outcome]:
    return {task.name: outcome for task, outcome in run_locally(*arguments)}


def test_a_log_that_never_ends_is_stopped(endless, scratch):
    found = outcomes([endless], 2, 0.5, scratch, nothing)
    assert found["endless"].result == {"reason": "timed out after 0.5 s; see --timeout"}
    assert found["endless"].files == {}
    assert list(scratch.iterdir()) == []


def test_logs_of_several_files(scratch, tmp_path):
    tasks = [Task.of(entry) for entry in recordings(tmp_path)]
    for outcome in outcomes(tasks, 2, 60.0, scratch, nothing).values():
        assert outcome.result["counts"]["scans"] == COUNT
        assert outcome.result["counts"]["warnings"] == []


def test_a_process_that_is_killed_and_one_that_fails(fine, scratch, tmp_path):
    """The first dies as soon as it says something, the second has nothing to read; the third is done."""
    (tmp_path / "empty.log").touch()
    (tmp_path / "long.log").write_text(room_log(400))
    long = Task.of(ManifestEntry("long", {"log": tmp_path / "long.log"}))
    empty = Task.of(ManifestEntry("empty", {"log": tmp_path / "empty.log"}))
    works = []

    class Watched(local_executor.WorkerProcess):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            works.append(self)

    def report(name, done, total, keyframes):
        assert (name, total) in {("long", 400), ("fine", 12)}
        assert 0 < keyframes <= done <= total
        if name == "long":
            works[0].process.send_signal(signal.SIGKILL)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(local_executor, "WorkerProcess", Watched)
        found = outcomes([long, empty, fine], 1, None, scratch, report)
    assert found["long"].result == {"reason": "its process was killed by signal 9"}
    assert found["empty"].result == {"reason": "log/empty.log: is empty; give a log with laser scans"}
    assert found["fine"].result["counts"]["scans"] == 12
    outputs = {"graph.json", "map.html", "map.png", "map.yaml", "trajectory.tum", "viewer.html"}
    assert set(found["fine"].files) == outputs
    assert list(scratch.iterdir()) == []


def test_a_process_that_cannot_even_start_says_why(fine, scratch, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    assert outcomes([fine], 1, None, scratch, nothing)["fine"].result == {
        "reason": "its process ended with code 1"
    }


def test_what_is_running_ends_with_the_iterator(endless, scratch, monkeypatch):
    works = []
    made = local_executor.WorkerProcess

    def start(*arguments):
        works.append(made(*arguments))
        return works[-1]

    monkeypatch.setattr(local_executor, "WorkerProcess", start)
    run = run_locally([endless], 1, 0.01, scratch, nothing)
    monkeypatch.setattr(made, "is_over", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        next(run)
    assert works[0].process.poll() == -signal.SIGKILL
    assert list(scratch.iterdir()) == []


def test_a_process_ends_with_whoever_has_started_it(endless, scratch):
    """Its standard input is closed when the parent is gone, however that went."""
    place = scratch / "endless"
    local_executor.prepare_workspace(place, endless, 1)
    process = subprocess.Popen(bootstrap.worker_command("nightly.worker", str(place)), stdin=subprocess.PIPE)
    time.sleep(0.5)
    assert process.poll() is None
    process.communicate(timeout=20)
    assert process.returncode == 1
