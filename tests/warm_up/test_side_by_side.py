"""Kernels are compiled before a night begins, and what is compiled meanwhile spoils no time."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli import bootstrap
from nscan_cli.cli.main import run
from nscan_cli.cli.nightly_progress import PlainProgress
from nscan_cli.kernels import cache_folder, machine_code
from nscan_cli.logs.load import log_from
from nscan_cli.nightly import local_executor, worker
from nscan_cli.nightly.html_report import html_report
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import check_log
from nscan_cli.nightly.task import Task
from nscan_cli.slam.frontend import tracking_kernels
from nscan_cli.warm_up import kernel_exercises, side_by_side, simulated_drive
from tests.cli.room_logs import room_log
from tests.data import OFFICE_LOG, TURNING_LOG, data_file, find_data


@pytest.fixture
def cache(tmp_path, monkeypatch):
    (tmp_path / "cache").mkdir()
    monkeypatch.setattr(side_by_side, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setattr(machine_code, "is_uncompiled", lambda _name: False)
    return tmp_path / "cache"


@pytest.fixture
def calls(monkeypatch):
    """The calls of processes, which end at once."""
    made: list[list[str]] = []

    start = subprocess.Popen

    def begun(call: list[str], **_how: object) -> subprocess.Popen[bytes]:
        made.append(call)
        return start([b"true"])

    monkeypatch.setattr(subprocess, "Popen", begun)
    return made


def test_once_on_each_machine(cache, calls, monkeypatch):
    side_by_side.compile_kernels({})
    side_by_side.compile_kernels({})
    assert calls == [
        bootstrap.worker_command("warm_up.kernel_exercises", *parts) for parts in kernel_exercises.FOR_ALL
    ]
    # Somebody has cleared the folder.
    with monkeypatch.context() as patch:
        patch.setattr(machine_code, "is_uncompiled", lambda _name: True)
        side_by_side.compile_kernels({})
    assert len(calls) == 4
    # Another processor, or another numba.
    monkeypatch.setattr(machine_code, "build_key", lambda: "another")
    side_by_side.compile_kernels({})
    assert len(calls) == 6


def test_the_command_compiles_all_and_leaves_nothing_to_nightly(cache, calls, monkeypatch, capsys):
    made: list[str] = []
    monkeypatch.setattr(kernel_exercises, "main", lambda *parts: made.extend(parts))
    monkeypatch.setattr(cache_folder, "cache_folder", lambda: cache)
    assert run(["warm-up"]) == 0
    assert made == [part for parts in kernel_exercises.FOR_ALL for part in parts]
    assert capsys.readouterr().err == f"nothing to compile: {cache}\n"
    side_by_side.compile_kernels({})
    assert calls == []
    monkeypatch.setattr(cache_folder, "cache_folder", lambda: None)
    assert run(["warm-up"]) == 73
    assert "set NUMBA_CACHE_DIR to one that is" in capsys.readouterr().err


def test_where_nothing_can_be_kept_nothing_is_done(calls, monkeypatch):
    monkeypatch.setattr(side_by_side, "cache_folder", lambda: None)
    side_by_side.compile_kernels({})
    assert calls == []
    assert side_by_side.cached_files() == set()


def test_before_the_first_log_begins(cache, monkeypatch, tmp_path):
    order = []
    monkeypatch.setattr(local_executor, "compile_kernels", lambda _environment: order.append("kernels"))

    class BegunError(Exception):
        pass

    def begin(*_arguments):
        order.append("log")
        raise BegunError

    monkeypatch.setattr(local_executor, "WorkerProcess", begin)
    with pytest.raises(BegunError):
        next(local_executor.run_locally([Task("a", {}, {}, {})], 1, None, tmp_path, lambda *_said: None))
    assert order == ["kernels", "log"]


def test_the_drive_has_what_a_night_can_have():
    log = log_from(simulated_drive.simulated_carmen_log(), "warm-up.log")
    assert (len(log), log.ranges.shape[1]) == (330, simulated_drive.BEAMS_PER_SCAN)
    assert log.report.skipped == {}
    assert log.no_return == pytest.approx(simulated_drive.NO_RETURN)
    assert np.isfinite(log.ranges).mean() > 0.5
    # Text that is parsed by a kernel; a way that comes back to where it was.
    assert log.source.bytes > 1 << 17
    assert log.odometry is not None
    assert np.hypot(*np.diff(log.odometry[:, :2], axis=0).T).sum() > 80


NEEDED_LATER = """
import sys
from nscan_cli import build_graph, nscan, read_log
from nscan_cli.kernels.decorators import Kernel
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.log_to_graph import map_log, slam_options
from nscan_cli.warm_up import kernel_exercises
loaded, load = [], Kernel._load_or_compile
def noted(kernel, types, arguments):
    loaded.append(kernel.py_func.__qualname__)
    return load(kernel, types, arguments)
Kernel._load_or_compile = noted
for parts in kernel_exercises.FOR_ALL:
    kernel_exercises.main(*parts)
exercised = len(loaded)
for log in sys.argv[1:]:
    build_graph(read_log(log))
log = read_log(sys.argv[1])
nscan(log, list(range(0, 30, 3)))
map_log(log, ReadingOptions(), slam_options(relations="pairwise"), 1, lambda *_progress: None)
print(exercised, *loaded[exercised:])
"""
"""Prints how many kernels are compiled beforehand, and which others logs need, and commands with one."""


def test_logs_need_no_kernel_that_is_not_compiled_beforehand():
    names = ("urg-carried.bag", "rplidar-hallway.bag", "mocap.bag")
    real = [path for path in (find_data(f"field/{name}") for name in names) if path is not None]
    logs = [OFFICE_LOG, TURNING_LOG, *map(str, real)]
    run = subprocess.run([sys.executable, "-c", NEEDED_LATER, *logs], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    exercised, *later = run.stdout.split()
    assert int(exercised) > 30
    assert later == []


NEEDED_BY_SLAM = """
import sys
from nscan_cli import build_graph, read_log
from nscan_cli.kernels.decorators import Kernel
from nscan_cli.warm_up import kernel_exercises
loaded, load = [], Kernel._load_or_compile
def noted(kernel, types, arguments):
    loaded.append(kernel.py_func.__qualname__)
    return load(kernel, types, arguments)
Kernel._load_or_compile = noted
log = read_log(sys.argv[1])
for parts in kernel_exercises.for_slam(log):
    kernel_exercises.main(*parts)
exercised = len(loaded)
build_graph(log)
print(exercised, *loaded[exercised:])
"""
"""Prints how many kernels `slam` compiles side by side for a log, and which others it needs."""


@pytest.mark.parametrize("log", [OFFICE_LOG, TURNING_LOG, "field/rplidar-hallway.bag"])
def test_slam_compiles_nothing_that_is_not_compiled_side_by_side(log):
    path = log if Path(log).exists() else data_file(log)
    run = subprocess.run([sys.executable, "-c", NEEDED_BY_SLAM, path], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    exercised, *later = run.stdout.split()
    assert int(exercised) > 30
    assert later == []


@pytest.mark.parametrize("compiles", [False, True])
def test_a_time_with_compilation_in_it_is_none(cache, tmp_path, compiles):
    # Without it nothing is compiled.
    importlib.import_module("numba")
    (tmp_path / "a.log").write_text(room_log(12))
    (tmp_path / "outputs").mkdir()
    task = Task.of(ManifestEntry("a", {"log": tmp_path / "a.log"}))
    told = {"inputs": task.inputs, "reading": task.reading, "mapping": {}, "threads": 1}

    def report(*_progress: int) -> None:
        if compiles:
            (cache / "follow.code").touch()

    result = worker.map_and_evaluate(told, tmp_path / "outputs", report)
    assert (result["times"]["seconds"] is None) == compiles


def test_the_tracking_kernel_is_there():
    assert callable(getattr(tracking_kernels, side_by_side.TRACKING_KERNEL))


def test_what_is_not_timed_is_said(tmp_path, capsys):
    night = {
        "key": "k", "tool": "0.1.0-0", "outcome": "done", "evaluation": None, "outputs": {},
        "counts": {"scans": 3, "duration": 9.0, "keyframes": 2, "pairwise": 1, "nscan": 0, "warnings": [],
                   "loops": {"accepted": 0, "refused": 0}},
        "times": {"seconds": None, "finished": "2026-11-21T03:00:00Z", "anew": ["the log has changed"]},
    }  # fmt: skip
    entry = ManifestEntry("a", {"log": Path("a.log")})
    PlainProgress(False).finished(entry, night)
    assert capsys.readouterr().err == "a: not timed, because kernels were compiled\n"
    text = html_report("small", [check_log(entry, [night], [], absent=False)], tmp_path).decode()
    assert '<span class="time">not timed: kernels were compiled during the run</span>' in text
    assert '<span class="time">2026-11-21 03:00:00 UTC; run again: the log has changed</span>' in text


def test_what_a_process_compiles_is_told(tmp_path, monkeypatch):
    """How many kernels are done, and which are in work; nothing says so when all processes have ended."""
    monkeypatch.setattr(side_by_side, "LOOK_INTERVAL", 0.01)
    (tmp_path / "a.old-1.code").touch()
    work = "import pathlib, time; (pathlib.Path.cwd() / 'a.new-1.lock').touch(); time.sleep(0.5)"
    command = [sys.executable, "-c", f"import os; os.chdir({str(tmp_path)!r}); {work}"]
    monkeypatch.setattr(bootstrap, "worker_command", lambda *_call: command)
    told = []

    def report(done: int, names: Sequence[str]) -> None:
        told.append((done, list(names)))
        (tmp_path / f"a.b{len(told)}-1.code").touch()

    side_by_side.compile_side_by_side(tmp_path, (("track",), ("refine",)), os.environ, report)
    assert [done for done, _ in told] == list(range(len(told)))
    assert told[-1][1] == ["new"]


def test_an_interrupt_ends_the_processes(tmp_path, monkeypatch):
    monkeypatch.setattr(bootstrap, "worker_command", lambda *_call: ["sleep", "60"])
    begun = []
    start = subprocess.Popen

    def begin(call: list[str], **how: Any) -> subprocess.Popen[bytes]:
        begun.append(start(call, **how))
        return begun[-1]

    monkeypatch.setattr(subprocess, "Popen", begin)

    def interrupted(*_progress: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side.compile_side_by_side(tmp_path, (("track",), ("refine",)), os.environ, interrupted)
    assert [process.returncode for process in begun] == [-9, -9]
