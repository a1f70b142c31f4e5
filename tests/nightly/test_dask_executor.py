"""On a real Dask scheduler with two worker processes, over loopback."""

from __future__ import annotations

import os
import signal
import socket
import threading

import pytest

from nscan_cli.cli.main import run
from nscan_cli.errors import InputMissingError, WrongUsageError
from nscan_cli.nightly import dask_executor
from nscan_cli.nightly.manifest import ManifestEntry, read_manifest
from nscan_cli.nightly.task import Task
from tests.cli.room_logs import COUNT
from tests.nightly.small_logs import recordings, results

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def scheduler():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as running:
        yield running.scheduler_address


def test_the_same_results_as_in_local_processes(scheduler, small, undisturbed, tmp_path):
    folder = tmp_path / "nights"
    assert run(["nightly", str(small), "-o", str(folder), "--scheduler", scheduler, "-q"]) == 0
    assert results(folder) == results(undisturbed)


def test_a_failure_costs_its_log_alone_and_reads_as_it_does_here(scheduler, small, tmp_path):
    (tmp_path / "empty.log").touch()
    bad = Task.of(ManifestEntry("empty", {"log": tmp_path / "empty.log"}))
    lost = Task.of(ManifestEntry("lost", {"log": tmp_path / "lost.log"}))
    fine = Task.of(read_manifest(str(small), None)[0])
    said = []
    found = {
        task.name: outcome
        for task, outcome in dask_executor.run_on_dask(
            [bad, lost, fine], scheduler, 60.0, lambda *progress: said.append(progress)
        )
    }
    assert found["empty"].result == {"reason": "log/empty.log: is empty; give a log with laser scans"}
    assert "lost.log: no such file" in found["lost"].result["reason"]
    assert found["one"].result["counts"]["scans"] == 12
    assert {name for name, *_ in said} <= {"one"}


def test_a_log_of_several_files_comes_along_whole(scheduler, tmp_path):
    tasks = [Task.of(entry) for entry in recordings(tmp_path)]
    for _task, outcome in dask_executor.run_on_dask(tasks, scheduler, 60.0, lambda *_progress: None):
        assert outcome.result["counts"]["scans"] == COUNT
        assert outcome.result["counts"]["warnings"] == []


def test_a_worker_that_dies_costs_no_log(scheduler, small, undisturbed, tmp_path):
    """Dask gives its log to the other one."""
    folder = tmp_path / "nights"
    client = distributed.Client(scheduler, set_as_default=False)
    pids = list(client.run(os.getpid).values())
    threading.Timer(0.8, lambda: os.kill(pids[0], signal.SIGKILL)).start()
    assert run(["nightly", str(small), "-o", str(folder), "--scheduler", scheduler, "-q"]) == 0
    client.wait_for_workers(2, timeout=20)
    client.close()
    assert results(folder) == results(undisturbed)


def test_a_worker_with_another_version_is_named(scheduler, small, monkeypatch):
    monkeypatch.setattr(dask_executor, "tool_key", lambda: "9.9.9-0")
    task = Task.of(read_manifest(str(small), None)[0])
    ((_task, outcome),) = dask_executor.run_on_dask([task], scheduler, None, lambda *_: None)
    assert "a Dask worker has nscan-cli" in outcome.result["reason"]
    assert "instead of 9.9.9-0; install the same version" in outcome.result["reason"]


def test_no_scheduler(monkeypatch):
    monkeypatch.setattr(dask_executor, "CONNECT_TIMEOUT", 0.5)
    with socket.socket() as port:
        port.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{port.getsockname()[1]}"
        with pytest.raises(InputMissingError, match="no Dask scheduler answers there"):
            next(dask_executor.run_on_dask([], address, None, lambda *_: None), None)
    with pytest.raises(WrongUsageError, match="not an address of the form tcp://HOST:PORT"):
        next(dask_executor.run_on_dask([], "here", None, lambda *_: None), None)
