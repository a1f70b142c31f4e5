"""A kernel that two processes need at the same time is compiled by one of them."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from nscan_cli.kernels import compile_lock as locks
from nscan_cli.kernels.compile_lock import compile_lock, kernels_in_work
from tests.kernels.kernels_kept import KERNELS, environment, files

SLOW = """
import time
import nscan_cli.kernels.machine_code as m
whole = m.object_code
def slow(compiled):
    print("compiled", flush=True)
    time.sleep(2)
    return whole(compiled)
m.object_code = slow
from some_kernels import add
print(add(1, 2))
"""


def test_the_second_process_waits_and_loads(tmp_path):
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    command = [sys.executable, "-c", SLOW]
    both = [
        subprocess.Popen(command, env=environment(tmp_path), stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    said = sorted(process.communicate()[0] for process in both)
    assert said == ["3\n", "compiled\n3\n"]
    assert len(files(tmp_path, "code")) == 1
    assert not files(tmp_path, "lock")


def test_names_of_kernels_in_work(tmp_path):
    with compile_lock(tmp_path / "nscan_cli.ndt.energy.inlier_share-ab-cd.code"):
        assert kernels_in_work(tmp_path) == ["inlier_share"]
    assert kernels_in_work(tmp_path) == []


def test_a_process_that_never_ends_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "PATIENCE", 0.1)
    began = time.monotonic()
    with compile_lock(tmp_path / "a.code"), compile_lock(tmp_path / "a.code"):
        assert time.monotonic() - began >= 0.1


@pytest.mark.parametrize("place", ["missing", "file"])
def test_where_there_can_be_no_lock_work_goes_on(tmp_path, place):
    (tmp_path / "file").touch()
    with compile_lock(tmp_path / place / "a.code"):
        assert not (tmp_path / place / "a.lock").exists()
