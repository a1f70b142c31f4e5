from __future__ import annotations

from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from tests.nightly.small_logs import write_logs


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A manifest over three small logs."""
    return write_logs(tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="session")
def undisturbed(small: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a first night over them; not to be changed."""
    folder = tmp_path_factory.mktemp("undisturbed") / "nights"
    assert run(["nightly", str(small), "-o", str(folder), "--jobs", "2", "-q"]) == 0
    return folder
