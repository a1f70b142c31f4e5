"""What the processes of a night import: the package that has started them, nothing of the current folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.room_logs import room_log
from tests.data import PACKAGE, REPOSITORY

NAMES = ("random", "json", "threading", "numpy", "nscan_cli/__init__", "nscan_cli/errors")
COMMAND = "import sys; from nscan_cli.cli.main import main; main()"


@pytest.fixture
def trap(tmp_path: Path) -> Path:
    """A folder with modules that leave a file beside it when they are run."""
    folder = tmp_path / "trap"
    for name in NAMES:
        path = folder / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"open({str(tmp_path / 'sprung')!r}, 'a').write({name!r}); raise SystemExit(9)\n")
    return folder


def test_nothing_of_the_current_folder_is_run(trap, tmp_path):
    (trap / "room.log").write_text(room_log(12))
    (trap / "logs.toml").write_text('[[log]]\nname = "room"\n')
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(
        [sys.executable, "-P", "-c", COMMAND, "nightly", "logs.toml", "-o", "nights", "--jobs", "1"],
        cwd=trap, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert not (tmp_path / "sprung").exists()
    assert done.returncode == 0, done.stderr
    assert (trap / "nights" / "room" / "graph.json").exists()


def test_the_package_is_the_one_that_starts_the_process(trap, tmp_path):
    """Even where the current folder, or PYTHONPATH, has another one."""
    package = tmp_path / "elsewhere" / "nscan_cli"
    (package / "nightly").mkdir(parents=True)
    for name in ("__init__.py", "nightly/__init__.py", "bootstrap.py"):
        shutil.copy(PACKAGE / name, package / name)
    (package / "nightly" / "worker.py").write_text("def main(place):\n    print(__file__, place)\n")
    done = subprocess.run(
        [sys.executable, "-P", str(package / "bootstrap.py"), "nightly.worker", "a place"],
        cwd=trap, env={**os.environ, "PYTHONPATH": str(REPOSITORY)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.stdout == f"{package / 'nightly' / 'worker.py'} a place\n", done.stderr
    assert not (tmp_path / "sprung").exists()
