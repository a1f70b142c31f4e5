"""The same bytes come out whatever the threads, the seed of Python's hashes, and the folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.room_logs import ALL_OUTPUTS
from tests.data import CORRIDOR_LOG


def outputs(folder: Path, threads: int, hash_seed: str) -> dict[str, bytes]:
    (folder / "log").symlink_to(CORRIDOR_LOG)
    command = [
        sys.executable,
        "-m",
        "nscan_cli",
        "slam",
        "log",
        "-q",
        "--threads",
        str(threads),
        *ALL_OUTPUTS,
    ]
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
    subprocess.run(command, cwd=folder, env=environment, check=True)
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "log"}


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return outputs(tmp_path_factory.mktemp("usual"), 1, "0")


@pytest.mark.parametrize(("threads", "hash_seed"), [(1, "1"), (2, "0"), (2, "4242"), (5, "random")])
def test_the_same_bytes(usual, tmp_path, threads, hash_seed):
    found = outputs(tmp_path, threads, hash_seed)
    assert len(found) == 7
    assert found == usual
