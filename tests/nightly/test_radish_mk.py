"""The pipeline by make, over small logs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.data import SAMPLE_LOGS
from tests.nightly.small_logs import write_logs

MAKEFILE = SAMPLE_LOGS / "radish.mk"
MAKE = shutil.which("make")
pytestmark = pytest.mark.skipif(MAKE is None, reason="make is not installed")


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two logs, the first with a reference."""
    write_logs(tmp_path)
    for name in ("one", "two"):
        subprocess.run(["gzip", "-n", str(tmp_path / f"{name}.log")], check=True)
    (tmp_path / "one.tum").rename(tmp_path / "one.reference.tum")
    return tmp_path


def make(logs: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    variables = [f"DATA={logs}", f"OUT={logs / 'out'}", f"NSCAN_CLI={sys.executable} -m nscan_cli"]
    call = [str(MAKE), "-f", str(MAKEFILE), *variables, *arguments]
    return subprocess.run(call, capture_output=True, text=True)


def made(done: subprocess.CompletedProcess[str]) -> list[str]:
    """The commands that were called, in order of the alphabet."""
    assert done.returncode == 0, done.stderr
    calls = [line.split("nscan_cli ")[1].split() for line in done.stdout.splitlines() if "nscan_cli " in line]
    return sorted(f"{call[0]} {Path(call[2]).name.partition('.')[0]}" for call in calls)


def test_all_is_made_and_made_again_only_when_it_has_to_be(logs):
    everything = ["evaluate one", "render one", "render two", "slam one", "slam two"]
    assert made(make(logs, "-j2")) == everything
    names = {path.name for path in (logs / "out").iterdir()}
    assert names == {f"{log}.{end}" for log in ("one", "two") for end in ("d", "json", "png", "yaml")} | {
        "one.errors.json"
    }
    assert made(make(logs, "-j2")) == []
    for newer, again in (
        ("two.log.gz", ["render two", "slam two"]),
        ("one.reference.tum", ["evaluate one"]),
        ("one.log.gz", ["evaluate one", "render one", "slam one"]),
    ):
        later = (logs / "out" / "one.errors.json").stat().st_mtime + 60
        os.utime(logs / newer, (later, later))
        assert made(make(logs, "-n")) == again
        os.utime(logs / newer, (1e9, 1e9))


def test_an_error_above_the_bound_fails_and_is_tried_again(logs):
    failed = make(logs, "-k", "MAX_TRANSLATION=0")
    assert failed.returncode == 2
    assert "is above 0 m" in failed.stderr
    assert not (logs / "out" / "one.errors.json").exists()
    assert (logs / "out" / "two.png").exists()
    assert made(make(logs, "MAX_TRANSLATION=1")) == ["evaluate one"]
